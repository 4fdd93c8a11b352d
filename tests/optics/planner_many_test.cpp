// Plans of a few to thousands of limits against blur formulas and halving in long double, and depth maps.
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "optics/depth_extremes.h"
#include "optics/planner.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

struct Wish {
  LimitKind kind;
  Side side;
  double near, far, limit;
};

/// Subjects around one depth, backgrounds behind and foregrounds in front; ties where `rounded`.
struct Scene {
  double f = 0.05, n_low = 1.4, n_high = 22.0, e_low = 0.0, e_high = 0.008, delta = 1e-6, epsilon = 0.02;
  std::vector<Wish> wishes;

  Scene(std::uint64_t seed, std::size_t count, bool rounded = false) {
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
        const double far = std::max(u - draw(0.0, 0.02), 0.0);
        wishes.push_back({LimitKind::Sharp, Side::Either, u, far, 1e-6 * draw(10.0, 40.0)});
      } else if (kind == 6) {
        const double near = std::max(draw(0.0, middle) - 0.3, 0.0);
        wishes.push_back({LimitKind::Blurred, Side::Behind, near, 0.0, 1e-6 * draw(5.0, 60.0)});
      } else {
        const double far = middle + 0.3 + draw(0.0, 1.0);
        wishes.push_back({LimitKind::Blurred, Side::Front, far + 1.0, far, 1e-6 * draw(5.0, 60.0)});
      }
    }
    if (random() % 4 == 0) delta = 0.0;
    if (random() % 4 == 0) n_low = 8.0;
  }

  PlanRequest Request() const {
    PlanRequest request;
    request.focal_length = f;
    request.f_numbers = {n_low, n_high};
    request.extensions = {e_low, e_high};
    request.sensor_tolerance = delta;
    request.f_number_tolerance = epsilon;
    for (const Wish& wish : wishes) {
      request.limits.push_back({std::to_string(request.limits.size()),
                                wish.kind,
                                {{PlanDepth::Vergence(wish.near), PlanDepth::Vergence(wish.far)}},
                                wish.limit,
                                wish.side});
    }
    return request;
  }
};

/// The truth, from the blur formula alone.
class Truth {
 public:
  explicit Truth(const Scene& scene) : scene_(scene) {}

  /// The largest of all ratios blur/limit (limit/blur for blurred limits) at a setting, tolerances included.
  long double WorstRatio(long double n, long double e) const {
    long double worst = 0;
    for (const Wish& wish : scene_.wishes) {
      for (const double u : {wish.near, wish.far}) {
        for (const long double shift : {-1.0L, 1.0L}) {
          const long double s = Blur(u, e + shift * scene_.delta);
          if (wish.kind == LimitKind::Sharp) {
            worst = std::max(worst, std::abs(s) / (n * (1 - static_cast<long double>(scene_.epsilon))) / wish.limit);
            continue;
          }
          const long double right =
              (wish.side == Side::Behind ? s : -s) / (n * (1 + static_cast<long double>(scene_.epsilon)));
          worst = std::max(worst, right > 0 ? wish.limit / right : 1e9L);
        }
      }
    }
    return worst;
  }

  /// How far apart the bounds on e are at N; concave in N.
  long double Room(long double n) const {
    long double high = scene_.e_high, low = scene_.e_low;
    for (const Wish& wish : scene_.wishes) {
      for (const double u : {wish.near, wish.far}) {
        const long double f = scene_.f, w = 1 - f * u, own = f * f * u / w;
        const long double reach =
            wish.limit * n / w * (1 + (wish.kind == LimitKind::Sharp ? -1.0L : 1.0L) * scene_.epsilon);
        if (wish.kind == LimitKind::Sharp) {
          high = std::min(high, own + reach - scene_.delta);
          low = std::max(low, own - reach + scene_.delta);
        } else if (wish.side == Side::Behind) {
          low = std::max(low, own + reach + scene_.delta);
        } else {
          high = std::min(high, own - reach - scene_.delta);
        }
      }
    }
    return high - low;
  }

  /// The N of the most room.
  long double Roomiest() const {
    long double low = scene_.n_low, high = scene_.n_high;
    for (int i = 0; i < 300; ++i) {
      const long double a = low + (high - low) / 3, b = high - (high - low) / 3;
      const bool rises = Room(a) < Room(b);
      (rises ? low : high) = rises ? a : b;
    }
    return low;
  }

  /// The smallest N with room, left of the roomiest one.
  long double SmallestN(long double roomiest) const {
    long double low = scene_.n_low, high = roomiest;
    if (Room(low) >= 0) return low;
    for (int i = 0; i < 100; ++i) {
      const long double middle = (low + high) / 2;
      (Room(middle) < 0 ? low : high) = middle;
    }
    return high;
  }

 private:
  long double Blur(double u, long double e) const { return e - scene_.f * (scene_.f + e) * u; }

  const Scene& scene_;
};

void Check(const Scene& scene) {
  const PlanRequest request = scene.Request();
  const Result<PlanAnswer> plan = Plan(request);
  ASSERT_TRUE(plan.has_value()) << plan.error().message;
  const Truth truth(scene);
  const long double roomiest = truth.Roomiest();
  const double most_room = static_cast<double>(truth.Room(roomiest));
  constexpr double kTooCloseToTell = 1e-15;
  if (std::abs(most_room) < kTooCloseToTell) return;
  ASSERT_EQ(plan->feasible, most_room > 0.0);
  if (!plan->feasible) return;
  const double n = plan->f_number.value, e = plan->extension.value;
  EXPECT_NEAR(n, static_cast<double>(truth.SmallestN(roomiest)), 1e-11 * n);
  EXPECT_NEAR(static_cast<double>(truth.WorstRatio(n, e)), plan->worst_ratio, 1e-9);
  for (const double aside : {-1e-8, 1e-8}) {  // the best e at this N: none beside it is better
    if (e + aside < scene.e_low || e + aside > scene.e_high) continue;
    EXPECT_GE(static_cast<double>(truth.WorstRatio(n, e + aside)), plan->worst_ratio - 1e-9);
  }
  ASSERT_EQ(plan->limits.size(), scene.wishes.size());
  for (std::size_t i = 0; i < plan->limits.size(); ++i)
    EXPECT_EQ(plan->limits[i].limit.value, request.limits[i].limit.value);
}

TEST(PlannerMany, FewLimitsAgreeWithHalving) {
  const long count = testing::ByLevel(300, 2000, 20000);
  for (long seed = 0; seed < count && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Check(Scene(static_cast<std::uint64_t>(seed), static_cast<std::size_t>(seed % 40), seed % 3 == 0));
  }
}

TEST(PlannerMany, ManyLimitsAgreeWithHalving) {
  const long count = testing::ByLevel(3, 12, 60);
  for (long seed = 0; seed < count && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    Check(Scene(static_cast<std::uint64_t>(seed), 130 + 997 * static_cast<std::size_t>(seed)));
  }
}

TEST(PlannerMany, EveryKindOfVectorFindsTheSame) {
  const long count = testing::ByLevel(100, 500, 5000);
  const auto solve = [&](long seed) {
    const std::size_t limits = seed % 20 == 0 ? 3000 : static_cast<std::size_t>(seed % 129);
    return *Plan(Scene(static_cast<std::uint64_t>(seed), limits, seed % 3 == 0).Request());
  };
  std::vector<PlanAnswer> native;
  for (long seed = 0; seed < count; ++seed) native.push_back(solve(seed));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (long seed = 0; seed < count; ++seed) {
      SCOPED_TRACE(::testing::Message() << hwy::TargetName(target) << " seed " << seed);
      const PlanAnswer plan = solve(seed);
      const PlanAnswer& same = native[static_cast<std::size_t>(seed)];
      EXPECT_EQ(plan.feasible, same.feasible);
      EXPECT_EQ(plan.f_number, same.f_number);
      EXPECT_EQ(plan.extension, same.extension);
      EXPECT_EQ(plan.worst_ratio, same.worst_ratio);
      EXPECT_EQ(plan.conflict, same.conflict);
      EXPECT_EQ(plan.relax, same.relax);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(PlannerMany, ANameTakenTwiceIsFoundAmongMany) {
  constexpr std::size_t kCount = 200;
  PlanRequest request = Scene(1, kCount).Request();
  const std::array<std::string, 4> kinds{"", "limit ", "a long name of more letters ",
                                         "the same at its start and end "};
  for (const std::string& kind : kinds) {
    for (std::size_t i = 0; i < kCount; ++i) {
      request.limits[i].name = kind + std::to_string(i) + (kind == kinds.back() ? " and here as well" : "");
    }
    ASSERT_TRUE(Plan(request)) << kind;
    for (const auto& [first, second] : {std::pair{0UL, kCount - 1}, {7UL, 8UL}, {40UL, 150UL}}) {
      PlanRequest twice = request;
      twice.limits[second].name = twice.limits[first].name;
      const Result<PlanAnswer> answer = Plan(twice);
      ASSERT_FALSE(answer) << twice.limits[first].name;
      EXPECT_NE(answer.error().message.find(twice.limits[first].name + ": this name is taken"), std::string::npos);
    }
  }
}

TEST(PlannerMany, ExactTiesAmongManyLimitsAreDecided) {
  // At f/2 and e = 10 mm infinity is blurred by exactly 5 mm: a limit of 5 mm touches, and so does every other one
  // here.
  constexpr std::size_t kCount = 3000;
  Scene scene(0, 0, false);
  scene.n_low = scene.n_high = 2.0;
  scene.e_low = scene.e_high = 0.01;
  scene.delta = scene.epsilon = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double thousandths = static_cast<double>(i % 1000);
    const double u = thousandths / 1000.0;  // blur (0.01 (1 - 0.05 u) - 0.0025 u)/2 = 0.005 - 0.0015 u
    scene.wishes.push_back({LimitKind::Sharp, Side::Either, u, u, (10000.0 - 3.0 * thousandths) / 2e6});
  }
  EXPECT_TRUE(Plan(scene.Request())->feasible);
  scene.wishes[1234].limit = std::nextafter(scene.wishes[1234].limit, 0.0);
  EXPECT_FALSE(Plan(scene.Request())->feasible);
}

TEST(DepthExtremes, OfSamplesAndClasses) {
  std::mt19937_64 random(7);
  for (const std::size_t size : {1u, 2u, 7u, 8u, 9u, 1000u, 4099u}) {
    std::vector<std::uint16_t> depths(size);
    std::vector<std::uint16_t> classes(size);
    std::uint16_t nearest = 65535, farthest = 0, nearest_of_all = 65535, farthest_of_all = 0;
    for (std::size_t i = 0; i < size; ++i) {
      depths[i] = static_cast<std::uint16_t>(random() % 5 == 0 ? 0 : random());
      classes[i] = static_cast<std::uint16_t>(random() % 3);
      if (depths[i] == 0) continue;
      nearest_of_all = std::min(nearest_of_all, depths[i]);
      farthest_of_all = std::max(farthest_of_all, depths[i]);
      if (classes[i] != 1) continue;
      nearest = std::min(nearest, depths[i]);
      farthest = std::max(farthest, depths[i]);
    }
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
