// The curve is sampled from the exact blur: straight on both sides of the plane in focus, but for diffraction.
#include "cli/offline/blur_chart.h"

#include <cmath>
#include <utility>

#include "base/quantity_text.h"
#include "cli/text/vergence_axis.h"

namespace lensd::cli {
namespace {

constexpr int kCurveSamples = 240;

Result<double> BlurUmAt(const CameraSystem& system, double vergence) {
  const Depth depth{Depth::Form::Vergence, vergence, Decimal::Shortest(vergence)};
  const Rational geometric = system.SignedBlur(PlaceOf(depth));
  if (system.wavelength) {
    const auto disk = system.BlurDisk(geometric);
    if (!disk) return PassOn(disk);
    return *disk * 1e6;
  }
  const auto um = Rounded(geometric * 1'000'000);
  if (!um) return PassOn(um);
  return std::abs(*um);
}

Result<std::optional<double>> PlaneInFocus(const CameraSystem& system) {
  if (!system.focal_length) return std::nullopt;
  const Rational f = system.focal_length->ToRational();
  const auto vergence = Rounded(optics::thin_lens::FocalPlane<Rational>(f, system.sensor_distance - f));
  if (!vergence) return PassOn(vergence);
  return *vergence;
}

}  // namespace

std::string SystemName(const CameraSystem& system) {
  const double sensor_m = Rounded(system.sensor_distance).value_or(0.0);
  const double diameter_m = Rounded(system.diameter).value_or(0.0);
  if (!system.focal_length) {
    const std::string hole = diameter_m > 0.0 ? "hole " + LengthText(Metres{diameter_m}, 4) + " wide" : "pinhole";
    return hole + ", sensor at " + LengthText(Metres{sensor_m}, 4);
  }
  const double f_m = system.focal_length->Nearest().value_or(0.0);
  return LengthText(Metres{f_m}, 4) + (diameter_m > 0.0 ? " f/" + Short(f_m / diameter_m, 3) : "");
}

Result<io::Chart> BlurOverDepth(const CameraSystem& system, Dioptres far, Dioptres near, BlurUnit unit) {
  const auto focus = PlaneInFocus(system);
  if (!focus) return PassOn(focus);
  const bool between = *focus && **focus > far.value && **focus < near.value;
  io::ChartLine curve{.width = 2.2};
  for (int i = 0; i <= kCurveSamples; ++i) {
    const double vergence = far.value + (near.value - far.value) * i / kCurveSamples;
    const double before = curve.points.empty() ? far.value : curve.points.back().x;
    for (const double at : {between && **focus > before && **focus < vergence ? **focus : vergence, vergence}) {
      const auto um = BlurUmAt(system, at);
      if (!um) return PassOn(um);
      curve.points.push_back({at, unit.Of(*um)});
    }
  }
  io::Chart chart;
  chart.x = VergenceAxis(far, near);
  chart.y = {.label = "blur diameter", .unit = unit.Name(), .low = 0.0};
  chart.lines.push_back(std::move(curve));
  if (between) chart.rules.push_back({.x = *focus, .label = "in focus"});
  chart.legend = io::LegendPlace::Below;
  return chart;
}

}  // namespace lensd::cli
