// What stacks are judged by: the fewest shots by trying all, and blur from the textbook's formulas.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "exact.h"
#include "optics/stack.h"

namespace lensd::optics::testing {

using Interval = std::pair<Exact, Exact>;

/// Fewest shots by trying all subsets of the places where a shot may stand; 0: impossible.
inline std::size_t BruteForce(const std::vector<Interval>& sharp, const Exact& low, const Exact& high) {
  std::vector<Exact> places;
  for (const Interval& interval : sharp) {
    const Exact place = std::min(interval.second, high);
    if (place < interval.first || place < low) return 0;
    places.push_back(place);
  }
  std::size_t fewest = places.size();
  for (unsigned subset = 1; subset < (1U << places.size()); ++subset) {
    const auto shots = static_cast<std::size_t>(std::popcount(subset));
    if (shots >= fewest) continue;
    bool all = true;
    for (const Interval& interval : sharp) {
      bool covered = false;
      for (std::size_t i = 0; i < places.size(); ++i) {
        covered = covered || ((subset >> i & 1U) != 0 && interval.first <= places[i] && places[i] <= interval.second);
      }
      all = all && covered;
    }
    if (all) fewest = shots;
  }
  return fewest;
}
/// Total blur at a shot off by `shift`, from the textbook formulas.
inline double TotalBlurAt(const PlanRequest& r, const StackShot& shot, double shift, double scale, double u) {
  const double f = r.focal_length.value;
  const double e = shot.extension.value + shift;
  const double p = r.pupil_factor.value;
  const double n = shot.f_number.value * scale;
  const double geometric = (e - f * (f + e) * u) / n / (1 + f * u * (1 / p - 1));
  const double disk = r.wavelength ? 2.44 * r.wavelength->value * n * (1 + e / f / p) : 0.0;
  return std::hypot(geometric, disk);
}

/// The worst blur at a depth with all tolerances.
inline double WorstBlurAt(const PlanRequest& request, const StackShot& shot, double u) {
  double worst = 0.0;
  for (const double side : {-1.0, 1.0}) {
    for (const double scale : {-1.0, 1.0}) {
      worst = std::max(worst, TotalBlurAt(request, shot, side * request.sensor_tolerance.value,
                                          1 + scale * request.f_number_tolerance.value, u));
    }
  }
  return worst;
}

/// Every depth of every limit is sharp in some shot whose stretch reaches it, and inside its stretch each shot meets
/// every limit (where a tighter limit begins, stretches may end in its first point).
inline void ExpectCovered(const PlanRequest& request, const StackAnswer& answer) {
  for (const BlurLimit& limit : request.limits) {
    const double one = limit.depths[0].one_end.vergence().value;
    const double other = limit.depths[0].other_end.vergence().value;
    for (int step = 0; step <= 500; ++step) {
      const double u = one + (other - one) * step / 500;
      bool covered = false;
      for (const StackShot& shot : answer.shots) {
        if (u < shot.far.value - 1e-9 || u > shot.near.value + 1e-9) continue;
        const bool sharp = WorstBlurAt(request, shot, u) <= limit.limit.value * (1 + 1e-6);
        const bool inside = u > shot.far.value + 1e-9 && u < shot.near.value - 1e-9;
        ASSERT_TRUE(sharp || !inside) << limit.name << " at " << u;
        covered = covered || sharp;
      }
      ASSERT_TRUE(covered) << limit.name << " at " << u;
    }
  }
}
}  // namespace lensd::optics::testing
