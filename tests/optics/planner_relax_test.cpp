// The relaxation factor where a class of a depth map makes thousands of gaps for the focal plane.
#include <gtest/gtest.h>

#include <random>

#include "optics/planner.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

/// A class that occupies every other millimetre, to be blurred by next to nothing, and subjects that no setting makes
/// sharp enough.
PlanRequest Impossible(std::size_t gaps, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  PlanRequest request;
  request.focal_length = 0.05;
  request.f_numbers = {1.4, 16.0};
  request.extensions = {0.0, 0.01};
  BlurLimit clutter{.name = "@1", .kind = LimitKind::Blurred, .depths = {}, .limit = Number(1e-9, "1e-9")};
  for (std::size_t i = 0; i < gaps; ++i) {
    const double metres = static_cast<double>(500 + 2 * i + random() % 2) * 1e-3;
    clutter.depths.push_back({PlanDepth::Distance(metres), PlanDepth::Distance(metres)});
  }
  request.limits = {{"wall", LimitKind::Sharp, {{PlanDepth::Distance(0.7), PlanDepth::Distance(9.0)}}, 1e-6},
                    std::move(clutter)};
  return request;
}

void Scale(PlanRequest& request, double ratio) {
  for (BlurLimit& limit : request.limits) {
    limit.limit = limit.limit.value * (limit.kind == LimitKind::Sharp ? ratio : 1.0 / ratio);
  }
}

TEST(PlannerRelax, OfThousandsOfGapsIsTheLeastOfAll) {
  const long gaps = testing::ByLevel(300, 2000, 30000);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const PlanRequest request = Impossible(static_cast<std::size_t>(gaps), seed);
    const auto answer = Plan(request);
    ASSERT_TRUE(answer) << answer.error().message;
    ASSERT_FALSE(answer->feasible);
    ASSERT_TRUE(answer->relax);
    EXPECT_GT(*answer->relax, 2.0);
    for (const double hair : {-1e-9, 1e-9}) {
      PlanRequest relaxed = request;
      Scale(relaxed, *answer->relax * (1.0 + hair));
      EXPECT_EQ(Plan(relaxed)->feasible, hair > 0.0) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace lensd::optics
