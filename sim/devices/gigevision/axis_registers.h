// Register counts of the simulated GigE camera's lens.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "drivers/api/lens.h"
#include "sim/scene.h"

namespace lensd::sim {

inline constexpr double kPerFNumber = 1e-3, kPerMillimetre = 1e-4;

/// One axis between register counts and the simulated lens' native units.
struct AxisRegisters {
  drivers::Axis axis = drivers::Axis::Focus;
  unsigned target = 0;
  unsigned place = 0;
  double (*native)(const LensSettings&, double count) = nullptr;
  double (*count)(const LensSettings&, double native) = nullptr;
  double grid = 1.0;                  ///< counts between positions that are reported
  std::uint32_t last_target = 0;      ///< as it stood when last looked at
  std::optional<std::uint32_t> told;  ///< count of the target it is at or goes to
  Instant told_at{};
};

inline double Same(const LensSettings&, double value) {
  return value;
}

/// Counted from the other end. Its own inverse.
inline double FromNear(const LensSettings& lens, double value) {
  return lens.steps - 1.0 - value;
}

inline double IrisSpan(const LensSettings& lens) {
  return std::log(lens.max_f_number / lens.min_f_number) / (lens.iris_steps - 1.0);
}
inline double IrisNative(const LensSettings& lens, double count) {
  return std::log(count * kPerFNumber / lens.min_f_number) / IrisSpan(lens);
}
inline double IrisCount(const LensSettings& lens, double native) {
  return lens.min_f_number * std::exp(native * IrisSpan(lens)) / kPerFNumber;
}
inline double ZoomNative(const LensSettings&, double count) {
  return count * kPerMillimetre;
}
inline double ZoomCount(const LensSettings&, double native) {
  return native / kPerMillimetre;
}

}  // namespace lensd::sim
