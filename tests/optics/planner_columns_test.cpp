// Limits as columns against the same limits one by one, and reductions of depth maps.
#include "optics/planner_columns.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <random>
#include <string>
#include <vector>

#include "optics/planner.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

struct Scene {
  std::vector<double> sharp_near, sharp_far, sharp_limit, behind_near, behind_limit, front_far, front_limit;
  ColumnLens lens{0.05, 1.4, 22.0, 0.0, 0.008, 1e-6, 0.02};

  LimitColumns Columns() const {
    return {sharp_near, sharp_far, sharp_limit, behind_near, behind_limit, front_far, front_limit};
  }

  /// Subjects around one depth, backgrounds behind and foregrounds in front; ties where `rounded`.
  Scene(std::uint64_t seed, std::size_t count, bool rounded) {
    std::mt19937_64 random(seed);
    const auto draw = [&](double low, double high) {
      const double value = std::uniform_real_distribution(low, high)(random);
      return rounded ? std::round(value * 100.0) / 100.0 : value;
    };
    const double middle = draw(0.5, 1.5);
    const int spread = static_cast<int>(random() % 40) + 1;
    for (std::size_t i = 0; i < count; ++i) {
      const double u = middle + draw(-0.01, 0.01) * spread;
      const auto kind = random() % 8;
      if (kind < 6) {
        sharp_near.push_back(u);
        sharp_far.push_back(std::max(u - draw(0.0, 0.02), 0.0));
        sharp_limit.push_back(1e-6 * draw(10.0, 40.0));
      } else if (kind == 6) {
        behind_near.push_back(std::max(draw(0.0, middle) - 0.3, 0.0));
        behind_limit.push_back(1e-6 * draw(5.0, 60.0));
      } else {
        front_far.push_back(middle + 0.3 + draw(0.0, 1.0));
        front_limit.push_back(1e-6 * draw(5.0, 60.0));
      }
    }
    if (random() % 4 == 0) lens.sensor_tolerance = 0.0;
    if (random() % 4 == 0) lens.n_low = 8.0;
  }

  PlanRequest Request() const {
    PlanRequest request;
    request.focal_length = lens.focal_length;
    request.f_numbers = {lens.n_low, lens.n_high};
    request.extensions = {lens.e_low, lens.e_high};
    request.sensor_tolerance = lens.sensor_tolerance;
    request.f_number_tolerance = lens.f_number_tolerance;
    const auto add = [&](LimitKind kind, Side side, double near, double far, double limit) {
      request.limits.push_back({std::to_string(request.limits.size()),
                                kind,
                                {{PlanDepth::Vergence(near), PlanDepth::Vergence(far)}},
                                limit,
                                side});
    };
    for (std::size_t i = 0; i < sharp_near.size(); ++i) {
      add(LimitKind::Sharp, Side::Either, sharp_near[i], sharp_far[i], sharp_limit[i]);
    }
    for (std::size_t i = 0; i < behind_near.size(); ++i) {
      add(LimitKind::Blurred, Side::Behind, behind_near[i], 0.0, behind_limit[i]);
    }
    for (std::size_t i = 0; i < front_far.size(); ++i) {
      add(LimitKind::Blurred, Side::Front, front_far[i] + 1.0, front_far[i], front_limit[i]);
    }
    return request;
  }
};

void Compare(const Scene& scene) {
  const ColumnPlan columns = PlanColumns(scene.lens, scene.Columns());
  const Result<PlanAnswer> plan = Plan(scene.Request());
  ASSERT_TRUE(plan.has_value()) << plan.error().message;
  ASSERT_EQ(columns.feasible, plan->feasible);
  if (!columns.feasible) return;
  EXPECT_NEAR(columns.n, plan->f_number.value, 2e-12 * columns.n);
  EXPECT_NEAR(columns.e, plan->extension.value, 1e-11);
  EXPECT_NEAR(columns.ratio, plan->worst_ratio, 1e-9);
}

TEST(PlannerColumns, FewLimitsAgreeWithPlan) {
  const long count = testing::ByLevel(500, 4000, 100000);
  for (long seed = 0; seed < count && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Compare(Scene(static_cast<std::uint64_t>(seed), static_cast<std::size_t>(seed % 12), seed % 3 == 0));
  }
}

TEST(PlannerColumns, ManyLimitsAgreeWithPlan) {
  const long count = testing::ByLevel(3, 12, 200);
  for (long seed = 0; seed < count && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Compare(Scene(static_cast<std::uint64_t>(seed), 130 + 997 * static_cast<std::size_t>(seed), false));
  }
}

TEST(PlannerColumns, EveryKindOfVectorFindsTheSame) {
  std::vector<ColumnPlan> native;
  const long count = testing::ByLevel(100, 500, 5000);
  const auto solve = [&](long seed) {
    const std::size_t limits = seed % 20 == 0 ? 3000 : static_cast<std::size_t>(seed % 129);
    const Scene scene(static_cast<std::uint64_t>(seed), limits, seed % 3 == 0);
    return PlanColumns(scene.lens, scene.Columns());
  };
  for (long seed = 0; seed < count; ++seed) native.push_back(solve(seed));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (long seed = 0; seed < count; ++seed) {
      const ColumnPlan plan = solve(seed);
      const ColumnPlan& same = native[static_cast<std::size_t>(seed)];
      EXPECT_EQ(plan.feasible, same.feasible) << hwy::TargetName(target) << " seed " << seed;
      EXPECT_EQ(plan.n, same.n) << hwy::TargetName(target) << " seed " << seed;
      EXPECT_EQ(plan.e, same.e) << hwy::TargetName(target) << " seed " << seed;
      EXPECT_EQ(plan.ratio, same.ratio) << hwy::TargetName(target) << " seed " << seed;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(PlannerColumns, ExactTiesAmongManyLimitsAreDecided) {
  // At f/2 and e = 10 mm infinity is blurred by exactly 5 mm: a limit of 5 mm touches, and so does every other one
  // here.
  constexpr std::size_t kCount = 3000;
  Scene scene(0, 0, false);
  scene.lens = {0.05, 2.0, 2.0, 0.01, 0.01, 0.0, 0.0};
  for (std::size_t i = 0; i < kCount; ++i) {
    const double thousandths = static_cast<double>(i % 1000);
    const double u = thousandths / 1000.0;  // blur (0.01 (1 - 0.05 u) - 0.0025 u)/2 = 0.005 - 0.0015 u
    scene.sharp_near.push_back(u);
    scene.sharp_far.push_back(u);
    scene.sharp_limit.push_back((10000.0 - 3.0 * thousandths) / 2e6);
  }
  EXPECT_TRUE(PlanColumns(scene.lens, scene.Columns()).feasible);
  scene.sharp_limit[1234] = std::nextafter(scene.sharp_limit[1234], 0.0);
  EXPECT_FALSE(PlanColumns(scene.lens, scene.Columns()).feasible);
}

TEST(PlannerColumns, ExtremesOfSamplesAndClasses) {
  std::mt19937_64 random(7);
  for (const std::size_t size : {1u, 2u, 7u, 8u, 9u, 1000u, 4099u}) {
    std::vector<double> values(size);
    std::vector<std::uint16_t> depths(size);
    std::vector<std::uint16_t> classes(size);
    std::uint16_t nearest = 65535, farthest = 0, nearest_of_all = 65535, farthest_of_all = 0;
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = std::normal_distribution()(random);
      depths[i] = static_cast<std::uint16_t>(random() % 5 == 0 ? 0 : random());
      classes[i] = static_cast<std::uint16_t>(random() % 3);
      if (depths[i] == 0) continue;
      nearest_of_all = std::min(nearest_of_all, depths[i]);
      farthest_of_all = std::max(farthest_of_all, depths[i]);
      if (classes[i] != 1) continue;
      nearest = std::min(nearest, depths[i]);
      farthest = std::max(farthest, depths[i]);
    }
    const Extremes extremes = ExtremesOf(values);
    EXPECT_EQ(extremes.least, *std::min_element(values.begin(), values.end()));
    EXPECT_EQ(extremes.greatest, *std::max_element(values.begin(), values.end()));
    const DepthExtremes of_class = ExtremesOfClass(depths, classes, 1);
    EXPECT_EQ(of_class.nearest, farthest == 0 ? 0 : nearest);
    EXPECT_EQ(of_class.farthest, farthest);
    const DepthExtremes of_all = ExtremesOfDepths(depths);
    EXPECT_EQ(of_all.nearest, farthest_of_all == 0 ? 0 : nearest_of_all);
    EXPECT_EQ(of_all.farthest, farthest_of_all);
  }
}

}  // namespace
}  // namespace lensd::optics
