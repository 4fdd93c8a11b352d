// Near is near: whoever says which way focus counts, and whichever way the lens is wired, focus goes to the distance
// that was asked for or the request is refused. What is true is computed here, from where the motor stands and how the
// lens of this test is wired.
#include <cmath>
#include <optional>
#include <random>
#include <string>

#include "test_level.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using drivers::Direction;
using Kind = Target::Kind;

constexpr double kFocalLength = 0.025, kTravel = 1e-3, kSteps = 1000.0;

Direction Other(Direction direction) {
  return direction == Direction::NearPositive ? Direction::NearNegative : Direction::NearPositive;
}

/// Dioptres in focus where the motor stands, as the lens is really wired.
double TrueVergence(Direction wiring, double native) {
  const double along = wiring == Direction::NearPositive ? native / kSteps : 1.0 - native / kSteps;
  const double extension = kTravel * along;
  return extension / (kFocalLength * (kFocalLength + extension));
}

/// A lens, and what everybody says of it.
struct Drawn {
  Direction wiring = Direction::NearPositive;
  std::optional<Direction> driver, key, seen;
  bool calibrated = false;
  std::optional<bool> approach_near;

  std::string Text() const {
    const auto of = [&](const std::optional<Direction>& says) {
      return std::string(!says ? "silent" : *says == wiring ? "right" : "wrong");
    };
    return std::string(drivers::DirectionName(wiring)) + ": driver " + of(driver) + ", key " + of(key) + ", seen " +
           of(seen) + (calibrated ? ", calibrated" : "");
  }
  /// Whom lensd should believe, by the order that is promised.
  std::optional<Direction> Believed() const {
    if (key) return key;
    if (calibrated) return wiring;
    return seen ? seen : driver;
  }
};

class DirectionTest : public RigTest {
 protected:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  bool Likely(double part) { return Uniform(0.0, 1.0) < part; }

  Drawn Draw() {
    Drawn drawn;
    if (Likely(0.5)) drawn.wiring = Direction::NearNegative;
    const auto word = [&](double right, double wrong) -> std::optional<Direction> {
      const double place = Uniform(0.0, 1.0);
      if (place < right) return drawn.wiring;
      if (place < right + wrong) return Other(drawn.wiring);
      return std::nullopt;
    };
    drawn.driver = word(0.3, 0.3);
    drawn.key = word(0.2, 0.15);
    drawn.seen = word(0.25, 0.0);
    drawn.calibrated = Likely(0.3);
    if (Likely(0.3)) drawn.approach_near = Likely(0.5);
    return drawn;
  }

  std::shared_ptr<Calibration> Measured(const Drawn& drawn) {
    auto calibration = std::make_shared<Calibration>();
    calibration->serial = "1";
    FocusCurve curve;
    curve.approach_near = drawn.approach_near.value_or(true);
    for (double native = 0.0; native <= kSteps; native += 50.0) {
      curve.points.push_back({Native{native}, {}, Dioptres{TrueVergence(drawn.wiring, native)}});
    }
    calibration->focus.push_back(curve);
    return calibration;
  }

  Result<void> OpenAs(const Drawn& drawn) {
    controls_ = std::make_shared<testing::FakeControls>();
    controls_->speed = 1e5;
    controls_->direction = drawn.driver;
    start_ = std::round(Uniform(100.0, 900.0));
    RigConfig config;
    AxisConfig& focus = config.axes[Axis::Focus];
    focus.direction = drawn.key;
    focus.seen = drawn.seen;
    focus.approach_near = drawn.approach_near;
    // Nominal figures hold moving toward near: a lens without backlash has them from either side.
    focus.backlash = drawn.approach_near == false ? 0.0 : 20.0;
    auto made = Rig::Create(config, testing::MakeFakeDevice(clock_, controls_, start_), clock_,
                            drawn.calibrated ? Measured(drawn) : nullptr);
    if (!made) return PassOn(made);
    rig_ = *std::move(made);
    return {};
  }

  Result<MoveOutcome> Go(Kind kind, double value) {
    Answers<MoveOutcome> answers;
    rig_->Move(Axis::Focus, {.kind = kind, .value = value, .from = {}, .take_up = {}}, answers.Take());
    RunUntil(answers);
    return answers.only();
  }

  /// Everything that goes by a direction goes the true way.
  void ExpectTheTrueWay(const Drawn& drawn) {
    const double wanted = Uniform(0.15, 1.3);
    const double extension = kFocalLength * kFocalLength * wanted / (1.0 - kFocalLength * wanted);
    const int how = std::uniform_int_distribution(0, 2)(random_);
    const auto moved = how == 0   ? Go(Kind::Distance, 1.0 / wanted)
                       : how == 1 ? Go(Kind::Vergence, wanted)
                                  : Go(Kind::Extension, extension);
    ASSERT_TRUE(moved) << drawn.Text() << ": " << moved.error().message;
    ASSERT_TRUE(moved->reached) << drawn.Text();
    const double step = TrueVergence(Direction::NearPositive, 1.0);
    EXPECT_NEAR(TrueVergence(drawn.wiring, moved->position.value), wanted, 1.1 * step) << drawn.Text();
    const auto& targets = controls_->focus_targets;
    const double last = targets.empty() ? start_ : targets.back();
    const double from = targets.size() > 1 ? targets[targets.size() - 2] : start_;
    if (last != from && drawn.approach_near != false) {
      EXPECT_EQ(last > from, drawn.wiring == Direction::NearPositive)
          << drawn.Text() << ": the last way goes toward near";
    }
    for (const double by : {30.0, -30.0}) {
      const double before = TrueVergence(drawn.wiring, moved->position.value);
      const auto nudged = Go(Kind::TowardNear, by);
      ASSERT_TRUE(nudged) << nudged.error().message;
      const double after = TrueVergence(drawn.wiring, nudged->position.value);
      EXPECT_GT(by * (after - before), by > 0.0 ? 0.0 : -1e-9) << drawn.Text();
    }
  }

  void ExpectRefused(const Drawn& drawn) {
    const double before = Focus();
    for (const auto& [kind, value] : {std::pair(Kind::Distance, 2.0), std::pair(Kind::Vergence, 0.5),
                                      std::pair(Kind::Extension, 0.4e-3), std::pair(Kind::TowardNear, 10.0)}) {
      const auto refused = Go(kind, value);
      ASSERT_FALSE(refused) << drawn.Text();
      EXPECT_EQ(refused.error().code, Code::Unsupported);
      EXPECT_NE(refused.error().message.find("`direction`"), std::string::npos) << refused.error().message;
      EXPECT_NE(refused.error().message.find("lensctl setup"), std::string::npos) << refused.error().message;
    }
    EXPECT_EQ(Focus(), before);
    EXPECT_FALSE(rig_->GetStatus().vergence) << "where it stands in optics is not known either";
    EXPECT_TRUE(Go(Kind::Native, 500.0)) << "native positions work";
    EXPECT_TRUE(Go(Kind::NativeRelative, 10.0));
  }

  std::mt19937_64 random_{20261127};
  double start_ = 0.0;
};

TEST_F(DirectionTest, FocusGoesTheTrueWayOrNowhere) {
  long true_ways = 0, refused = 0, told_wrong = 0;
  for (long i = testing::ByLevel(200, 1000, 100000); i > 0; --i) {
    const Drawn drawn = Draw();
    const auto opened = OpenAs(drawn);
    if (drawn.key && *drawn.key != drawn.wiring && drawn.calibrated) {
      EXPECT_FALSE(opened) << drawn.Text() << ": the calibration contradicts the key";
      ++refused;
      continue;
    }
    ASSERT_TRUE(opened) << drawn.Text() << ": " << opened.error().message;
    const FocusDirection direction = rig_->GetStatus().direction;
    ASSERT_EQ(direction.direction, drawn.Believed()) << drawn.Text();
    if (!drawn.Believed()) {
      ExpectRefused(drawn);
      ++refused;
      // Until it was seen.
      Answers<void> set;
      Run(1s);
      rig_->SetSeenDirection(drawn.wiring, set.Take());
      RunUntil(set);
      ASSERT_TRUE(set.only()) << set.only().error().message;
      controls_->focus_targets.clear();
      start_ = Focus();
      ExpectTheTrueWay(drawn);
      ++true_ways;
    } else if (*drawn.Believed() == drawn.wiring) {
      ExpectTheTrueWay(drawn);
      ++true_ways;
    } else {
      // Whoever is believed is wrong, and only what was measured could have told.
      EXPECT_TRUE(drawn.key || !drawn.seen) << drawn.Text();
      EXPECT_EQ(direction.warning.empty(), !drawn.seen) << drawn.Text() << ": " << direction.warning;
      ++told_wrong;
    }
    if (HasFailure()) break;
  }
  std::printf("the true way %ld, refused %ld, told the wrong way by a person or a driver %ld\n", true_ways, refused,
              told_wrong);
}

TEST_F(DirectionTest, WhatWasMeasuredComesBeforeWhatAStandardSays) {
  Drawn drawn{
      .wiring = Direction::NearNegative, .driver = Direction::NearPositive, .key = {}, .seen = {}, .approach_near = {}};
  drawn.seen = Direction::NearNegative;
  ASSERT_TRUE(OpenAs(drawn));
  const FocusDirection seen = rig_->GetStatus().direction;
  EXPECT_EQ(seen.from, DirectionFrom::Seen);
  EXPECT_NE(seen.warning.find("the fake lens"), std::string::npos) << "a contradiction is told: " << seen.warning;
  ExpectTheTrueWay(drawn);
  // And is forgotten on demand.
  Answers<void> set;
  Run(1s);
  rig_->SetSeenDirection(std::nullopt, set.Take());
  RunUntil(set);
  ASSERT_TRUE(set.only());
  EXPECT_EQ(rig_->GetStatus().direction.from, DirectionFrom::Driver);
}

TEST_F(DirectionTest, ACalibrationMadeWithoutADirectionIsApproachedAsItWasMeasured) {
  for (const Direction wiring : {Direction::NearPositive, Direction::NearNegative}) {
    controls_->direction.reset();
    controls_->speed = 1e5;
    Open({}, 500);
    EXPECT_TRUE(rig_->approaches_up(Axis::Focus));
    Drawn drawn{
        .wiring = wiring, .driver = {}, .key = {}, .seen = {}, .approach_near = wiring == Direction::NearPositive};
    Answers<void> set;
    rig_->SetCalibration(Measured(drawn), set.Take());
    RunUntil(set);
    ASSERT_TRUE(set.only()) << set.only().error().message;
    EXPECT_TRUE(rig_->approaches_up(Axis::Focus));
    EXPECT_EQ(rig_->GetStatus().direction.direction, wiring);
    const auto moved = Go(Kind::Vergence, 1.0);
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_NEAR(TrueVergence(wiring, moved->position.value), 1.0, 0.002);
  }
}

TEST_F(DirectionTest, NotWhileItMoves) {
  Open({}, 100);
  Answers<MoveOutcome> moved;
  rig_->Move(Axis::Focus, At(900), moved.Take());
  Run(100ms);
  Answers<void> set;
  rig_->SetSeenDirection(Direction::NearNegative, set.Take());
  RunUntil(set);
  ASSERT_FALSE(set.only());
  EXPECT_EQ(set.only().error().code, Code::Busy);
  RunUntil(moved);
}

TEST_F(DirectionTest, WhichRegionIsNearestTakesADirection) {
  controls_->direction.reset();
  Open({}, 500);
  for (const auto policy : {autofocus::Policy::Nearest, autofocus::Policy::Farthest, autofocus::Policy::Widest}) {
    Answers<AutofocusOutcome> found;
    AutofocusRequest request;
    request.regions = {{0.0, 0.0, 0.5, 1.0}, {0.5, 0.0, 0.5, 1.0}};
    request.policy = policy;
    rig_->Autofocus(std::move(request), nullptr, found.Take());
    RunUntil(found);
    EXPECT_EQ(found.only().has_value(), policy == autofocus::Policy::Widest);
    if (!found.only()) {
      EXPECT_EQ(found.only().error().code, Code::Unsupported);
    }
  }
}

TEST_F(DirectionTest, AnApproachThatCannotBeFollowedIsTold) {
  controls_->direction.reset();
  RigConfig config;
  config.axes[Axis::Focus].approach_near = true;
  Open(config, 500);
  EXPECT_NE(rig_->GetStatus().direction.warning.find("approach"), std::string::npos);
  EXPECT_TRUE(rig_->approaches_up(Axis::Focus));
}

}  // namespace
}  // namespace lensd::rig
