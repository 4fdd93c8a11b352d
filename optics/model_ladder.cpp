// What each rung leaves out is bounded by theorems, not by sampling:
// - The signed blur s N = e - f (f + e) U is linear in e and linear in U, and falls as 1/N. So the largest |s| is at a
//   corner of the (e, U) box with the smallest N; and where all corners have one sign the smallest |s| is at a corner
//   with the largest N.
// - b² + b_d² = (s N)²/N² + (k λ (1 + e/f))² N² is convex in N, in e and in U, so its largest value is at a corner too.
// - hypot(s, b_d) - |s| = b_d²/(hypot(s, b_d) + |s|) rises with b_d and falls with |s|.
// - hypot changes by no more than its arguments do together, which adds up the effects of pupil factor and calibration.
#include "optics/model_ladder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "optics/blur.h"
#include "optics/light.h"

namespace lensd::optics {
namespace {

/// Covers the rounding of these few operations, each within half an ulp.
constexpr double kRoundingUp = 1.0 + 64 * std::numeric_limits<double>::epsilon();

/// 1/p - 1, exact where p is close to 1.
double PupilTerm(const LadderRanges& r) {
  return (1.0 - r.pupil_factor) / r.pupil_factor;
}

/// Signed blur at the four corners of the (e, U) box.
std::array<double, 4> CornerBlur(const LadderRanges& r, FNumber f_number) {
  const ThinLens retracted{r.focal_length, f_number, r.extension_low};
  const ThinLens extended{r.focal_length, f_number, r.extension_high};
  return {SignedBlur(retracted, r.far).value, SignedBlur(retracted, r.near).value, SignedBlur(extended, r.far).value,
          SignedBlur(extended, r.near).value};
}

double LargestBlur(const LadderRanges& r) {
  double largest = 0.0;
  for (const double blur : CornerBlur(r, r.f_number_low)) largest = std::max(largest, std::abs(blur));
  return largest;
}

double SmallestBlur(const LadderRanges& r) {
  const auto blur = CornerBlur(r, r.f_number_high);
  const auto [low, high] = std::minmax_element(blur.begin(), blur.end());
  return std::max({0.0, *low, -*high});
}

double Airy(const LadderRanges& r, FNumber f_number, Metres extension) {
  if (!r.wavelength) return 0.0;
  const FNumber working = WorkingFNumber(f_number, Magnification(r.focal_length, extension));
  return DiffractionBlur(r.convention, *r.wavelength, working).value;
}

/// What a model without any blur leaves out of blur with diffraction.
double LargestTotal(const LadderRanges& r) {
  if (!r.wavelength) return LargestBlur(r);
  double largest = 0.0;
  for (const FNumber n : {r.f_number_low, r.f_number_high}) {
    const auto blur = CornerBlur(r, n);
    for (std::size_t i = 0; i < blur.size(); ++i) {
      const double disk = Airy(r, n, i < 2 ? r.extension_low : r.extension_high);
      largest = std::max(largest, std::hypot(blur[i], disk));
    }
  }
  return largest;
}

/// What geometric blur alone leaves out of blur with diffraction.
double DiffractionPart(const LadderRanges& r) {
  const double disk = Airy(r, r.f_number_high, r.extension_high);
  if (disk == 0.0) return 0.0;
  const double least = SmallestBlur(r);
  return disk * (disk / (std::hypot(least, disk) + least));
}

/// What nominal figures leave out of measured ones. With g = 1 + f U (1/p - 1) and W = 1 - f U, an extension off by Δ
/// changes blur by s (1/g - 1) + Δ W/(N g), both factors monotone in U, and the diffraction disk by
/// k λ N ((1/p - 1) e + Δ/p)/f.
double CalibrationPart(const LadderRanges& r) {
  if (r.pupil_factor == 1.0 && r.calibration_error.value == 0.0) return 0.0;
  const double f = r.focal_length.value;
  const double shift = r.calibration_error.value;
  double pupil = 0.0;
  double slope = 0.0;
  for (const Dioptres u : {r.far, r.near}) {
    const double divisor = PupilDivisor(r.focal_length, u, r.pupil_factor);
    if (!(divisor > 0.0)) return std::numeric_limits<double>::infinity();
    pupil = std::max(pupil, std::abs(f * u.value * (PupilTerm(r))) / divisor);
    slope = std::max(slope, std::abs(ObjectDepth(u).FocusGap(r.focal_length)) / divisor);
  }
  const double blur = LargestBlur(r) * pupil + shift * slope / r.f_number_low.value;
  if (!r.wavelength) return blur;
  const double longest = std::max(std::abs(r.extension_low.value), std::abs(r.extension_high.value));
  const double change = longest * std::abs(PupilTerm(r)) + shift / r.pupil_factor;
  return blur + DiffractionFactor(r.convention) * r.wavelength->value * r.f_number_high.value * change / f;
}

/// Smallest and largest f-number that may be chosen, before its tolerance.
std::pair<double, double> FNumberRange(const PlanRequest& request) {
  double low = request.f_numbers.low.value, high = request.f_numbers.high.value;
  if (!request.stops.empty()) {
    const auto by_value = [](const Number& a, const Number& b) { return a.value < b.value; };
    const auto [least, most] = std::minmax_element(request.stops.begin(), request.stops.end(), by_value);
    low = least->value;
    high = most->value;
  }
  if (!request.apertures_are_diameters) return {low, high};
  const double f = request.focal_length.value;
  return {f / high, f / low};
}

}  // namespace

std::string_view RungName(Rung rung) {
  constexpr std::array<std::string_view, 4> kNames{"pinhole", "thin", "diffraction", "calibrated"};
  return kNames[static_cast<std::size_t>(rung)];
}

Metres LeftOut(Rung rung, const LadderRanges& ranges) {
  if (rung == Rung::Calibrated) return {0.0};
  double bound = CalibrationPart(ranges);
  if (rung == Rung::Thin) bound += DiffractionPart(ranges);
  if (rung == Rung::Pinhole) bound += LargestTotal(ranges);
  return {bound * kRoundingUp};
}

ChosenModel SimplestModel(const LadderRanges& ranges, Metres tolerance) {
  for (const Rung rung : {Rung::Pinhole, Rung::Thin, Rung::Diffraction}) {
    const Metres error = LeftOut(rung, ranges);
    if (error <= tolerance) return {rung, error};
  }
  return {Rung::Calibrated, Metres{0.0}};
}

Metres DefaultModelTolerance(std::optional<Metres> tightest_limit, std::optional<Metres> pixel) {
  return std::max(tightest_limit.value_or(Metres{0.0}) / 10.0, pixel.value_or(Metres{0.0}) / 4.0);
}

ChosenModel ModelFor(const PlanRequest& request, std::span<const LimitAnswer> limits) {
  if (request.liquid) return {.rung = Rung::Thin, .error = Metres{0.0}};
  const auto [n_low, n_high] = FNumberRange(request);
  const double delta = request.sensor_tolerance.value, epsilon = request.f_number_tolerance.value;
  LadderRanges ranges{.focal_length = {request.focal_length.value},
                      .f_number_low = {n_low * (1.0 - epsilon)},
                      .f_number_high = {n_high * (1.0 + epsilon)},
                      .extension_low = {request.extensions.low.value - delta},
                      .extension_high = {request.extensions.high.value + delta},
                      .far = {0.0},
                      .near = {0.0},
                      .convention = request.diffraction,
                      .pupil_factor = request.pupil_factor.value,
                      .calibration_error = request.calibration_error};
  if (request.wavelength) ranges.wavelength = Metres{request.wavelength->value};
  std::optional<Metres> tightest;
  if (!limits.empty()) {
    double near = limits.front().near.value, far = limits.front().far.value, least = limits.front().limit.value;
    for (const LimitAnswer& limit : limits) {
      near = std::max(limit.near.value, near);
      far = std::min(limit.far.value, far);
      least = std::min(limit.limit.value, least);
    }
    ranges.near = {near}, ranges.far = {far}, tightest = Metres{least};
  }
  return SimplestModel(ranges, request.model_tolerance.value_or(DefaultModelTolerance(tightest, request.pixel)));
}

}  // namespace lensd::optics
