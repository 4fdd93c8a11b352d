// The planner without names or allocation: limits as plain columns of numbers, for loops that plan often and for inputs
// as large as a depth map.
#pragma once

#include <cstdint>
#include <span>

namespace lensd::optics {

/// The lens and its ranges; lengths in metres, 0 < n_low <= n_high, -f < e_low <= e_high, tolerances >= 0.
struct ColumnLens {
  double focal_length = 0.0;
  double n_low = 0.0, n_high = 0.0;
  double e_low = 0.0, e_high = 0.0;
  double sensor_tolerance = 0.0;
  double f_number_tolerance = 0.0;
};

/// Limits by kind. Vergences in dioptres, 0 <= far <= near < 1/f; limits in metres, > 0. Columns of one kind have equal
/// lengths.
struct LimitColumns {
  std::span<const double> sharp_near, sharp_far, sharp_limit;
  std::span<const double> behind_near, behind_limit;  ///< blurred, all of it behind the focal plane
  std::span<const double> front_far, front_limit;     ///< blurred, all of it in front
};

struct ColumnPlan {
  bool feasible = false;
  double n = 0.0;      ///< the smallest f-number
  double e = 0.0;      ///< of the extensions it allows the one of the smallest worst ratio
  double ratio = 0.0;  ///< that ratio
};

/// Objective::Light over these limits. The verdict is certain: what double precision cannot decide is decided exactly,
/// on the decimals that the doubles stand for. Up to 128 limits are solved without allocation unless exactness is
/// called for. Many are solved by a sample to which the limits that it breaks are added: expected linear time. Any
/// thread.
ColumnPlan PlanColumns(const ColumnLens& lens, const LimitColumns& limits);

/// Least and greatest of at least one value in one pass at memory speed; NaN is not allowed.
struct Extremes {
  double least = 0.0;
  double greatest = 0.0;
};
Extremes ExtremesOf(std::span<const double> values);

struct DepthExtremes {
  std::uint16_t nearest = 0;
  std::uint16_t farthest = 0;
};
/// The same of those depth samples (0: unknown) whose `classes` entry is `wanted`; {0, 0} when there are none. Equal
/// lengths.
DepthExtremes ExtremesOfClass(std::span<const std::uint16_t> depths, std::span<const std::uint16_t> classes,
                              std::uint16_t wanted);
/// The same of all known depth samples.
DepthExtremes ExtremesOfDepths(std::span<const std::uint16_t> depths);

}  // namespace lensd::optics
