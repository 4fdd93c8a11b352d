// A lens whose extension bends, and what calibrations of it say.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "rig/calibration.h"
#include "rig/optics_table.h"

namespace lensd::rig {

using drivers::Axis;

inline constexpr double kFocalLength = 0.025;

inline drivers::NominalOptics Nominal() {
  return {.focal_length_m = kFocalLength,
          .min_f_number = 2.0,
          .max_f_number = 16.0,
          .min_extension_m = 0.0,
          .max_extension_m = 1e-3};
}

inline drivers::Capabilities Motors() {
  drivers::Capabilities can{.driver = "test", .model = "", .serial = "", .axes = {}};
  can.axes[Axis::Focus] = {.maximum = Native{1000.0},
                           .direction = drivers::KnownDirection{drivers::Direction::NearPositive, "the test"}};
  can.axes[Axis::Iris] = {.maximum = Native{100.0}};
  can.axes[Axis::Zoom] = {.maximum = Native{100.0}};
  can.axes[Axis::Filter] = {.unit = drivers::NativeUnit::Position, .maximum = Native{4.0}};
  return can;
}

/// The lens as it really is: extension over steps bends by a tenth of a millimetre.
inline double TrueExtension(double steps) {
  return 1e-3 * (0.05 + 0.0009 * steps + 0.1 * std::sin(std::numbers::pi * steps / 1000.0) / std::numbers::pi);
}

inline FocusCurve Measured(int points = 11, double gain = 1.0) {
  FocusCurve curve;
  curve.error = Metres{0.5e-6};
  for (int i = 0; i < points; ++i) {
    const double steps = 1000.0 * i / (points - 1);
    curve.points.push_back({Native{steps}, Metres{gain * TrueExtension(steps)}, std::nullopt});
  }
  return curve;
}

inline std::shared_ptr<Calibration> With(std::vector<FocusCurve> curves) {
  auto calibration = std::make_shared<Calibration>();
  calibration->focus = std::move(curves);
  return calibration;
}

inline OpticsTable Table(std::shared_ptr<const Calibration> calibration, const RigConfig& config = {},
                         const drivers::NominalOptics& nominal = Nominal()) {
  auto made = OpticsTable::Create(nominal, Motors(), config, std::move(calibration));
  EXPECT_TRUE(made) << made.error().message;
  return *made;
}

}  // namespace lensd::rig
