// Several regions and the policy that picks one, on a scene with a wall at 0.9 m on the left and one at 1.6 m on the
// right.
#include <chrono>

#include "sim/scene.h"
#include "sim/world.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using autofocus::Policy;

constexpr drivers::Region kNear{0.1, 0.3, 0.2, 0.2}, kFar{0.7, 0.3, 0.2, 0.2}, kFarToo{0.65, 0.6, 0.2, 0.2};
constexpr double kNearD = 1 / 0.9, kFarD = 1 / 1.6;

class RegionsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto scene = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/regimes/two-depths.toml");
    ASSERT_TRUE(scene) << scene.error().message;
    scene_ = std::make_shared<const sim::Scene>(*std::move(scene));
    pictures_ = *sim::Pictures::Create(scene_);
  }
  static void TearDownTestSuite() {
    pictures_.reset();
    scene_.reset();
  }

  Result<AutofocusOutcome> Focus(std::vector<drivers::Region> regions, Policy policy, std::string method = "auto",
                                 double start = 3000) {
    SteppedClock clock;
    auto world = sim::OpenWorld(scene_, clock, {.seed = 3, .focus_start = Native{start}, .pictures = pictures_});
    auto rig = *Rig::Create({}, std::move(world->device), clock);
    Answers<AutofocusOutcome> answers;
    AutofocusRequest request{.regions = std::move(regions), .policy = policy, .method = std::move(method)};
    rig->Autofocus(std::move(request), nullptr, answers.Take());
    while (answers.all.empty() && clock.Now() < Instant{100s}) clock.AdvanceTo(rig->Step(clock.Now()));
    return answers.only();
  }

  static std::shared_ptr<const sim::Scene> scene_;
  static std::shared_ptr<sim::Pictures> pictures_;
};
std::shared_ptr<const sim::Scene> RegionsTest::scene_;
std::shared_ptr<sim::Pictures> RegionsTest::pictures_;

TEST_F(RegionsTest, ThePolicyPicksTheRegion) {
  struct Case {
    std::vector<drivers::Region> regions;
    Policy policy;
    double expected_d;
  };
  const Case cases[] = {{{kNear, kFar}, Policy::Nearest, kNearD},        {{kFar, kNear}, Policy::Nearest, kNearD},
                        {{kNear, kFar}, Policy::Farthest, kFarD},        {{kFar, kNear}, Policy::Farthest, kFarD},
                        {{kNear, kFar, kFarToo}, Policy::Widest, kFarD}, {{kNear}, Policy::Farthest, kNearD}};
  for (const Case& one : cases) {
    const auto outcome = Focus(one.regions, one.policy);
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_TRUE(outcome->focused) << outcome->reason;
    // Half a depth of field: 2 px N/(f Z_s).
    EXPECT_NEAR(outcome->vergence->value, one.expected_d, 2 * 3.45e-6 * 2.8 / (0.025 * 0.0257)) << outcome->reason;
    EXPECT_EQ(outcome->candidates.size(), one.regions.size() > 1 ? one.regions.size() : 0u);
    // A session of its own for each region would take three frames and more for each. One place may be looked at twice,
    // where the blur there is not quite what the optics promise.
    EXPECT_LE(outcome->frames, 5 + 2 * static_cast<int>(one.regions.size()));
  }
}

TEST_F(RegionsTest, SearchMethodsServeSeveralRegionsToo) {
  const auto outcome = Focus({kFar, kNear}, Policy::Nearest, "sweep");
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_TRUE(outcome->focused) << outcome->reason;
  EXPECT_NEAR(outcome->vergence->value, kNearD, 2 * 3.45e-6 * 2.8 / (0.025 * 0.0257));
  EXPECT_NE(outcome->reason.find("the nearest of 2 regions"), std::string::npos) << outcome->reason;
}

TEST_F(RegionsTest, TooManyOrOutsideAreRefused) {
  EXPECT_EQ(Focus(std::vector<drivers::Region>(17, kNear), Policy::Nearest).error().code, Code::InvalidArgument);
  EXPECT_EQ(Focus({kNear, {0.9, 0.9, 0.2, 0.2}}, Policy::Nearest).error().code, Code::InvalidArgument);
}

}  // namespace
}  // namespace lensd::rig
