#include "planner_report.h"

#include <cmath>
#include <limits>

#include "optics/aperture.h"
#include "optics/blur.h"
#include "optics/conjugates.h"
#include "optics/light.h"
#include "planner_cases.h"

namespace lensd::optics {

namespace {

ObjectDepth ToObjectDepth(const PlanDepth& depth) {
  if (depth.is_vergence) return Dioptres{depth.number.value};
  return Metres{depth.number.value};
}

/// Blur that counts for a limit: with diffraction for a sharp one; for a blurred one geometric, and none on the wrong
/// side.
double BlurAt(const PlanRequest& request, const BlurLimit& limit, const PlanDepth& depth, double n, double e) {
  const Metres f{request.focal_length.value};
  const ObjectDepth object = ToObjectDepth(depth);
  const double pupil = request.pupil_factor.value;
  const double signed_blur = request.liquid
                                 ? (e - f.value * f.value * depth.vergence().value) / n
                                 : SignedBlur(ThinLens{f, {n}, {e}}, object).value / PupilDivisor(f, object, pupil);
  if (limit.kind == LimitKind::Blurred) {
    if (limit.side == Side::Either) return std::abs(signed_blur);
    return std::max(limit.side == Side::Behind ? signed_blur : -signed_blur, 0.0);
  }
  const Metres geometric{std::abs(signed_blur)};
  if (!request.wavelength) return geometric.value;
  const FNumber working = WorkingFNumber({n}, Magnification(f, {e}), pupil);
  return TotalBlur(geometric, DiffractionBlur(request.diffraction, {request.wavelength->value}, working)).value;
}

/// Largest (sharp) or smallest (blurred) blur at a depth over the tolerances.
double WorstBlurAt(const PlanRequest& request, const BlurLimit& limit, const PlanDepth& depth, double n, double e) {
  const double delta = request.sensor_tolerance.value, epsilon = request.f_number_tolerance.value;
  const double out = BlurAt(request, limit, depth, n, e + delta);
  const double in = BlurAt(request, limit, depth, n, e - delta);
  return limit.kind == LimitKind::Sharp ? std::max(in, out) / (1.0 - epsilon) : std::min(in, out) / (1.0 + epsilon);
}

}  // namespace

namespace {

/// Everything of Fare() but the name.
LimitAnswer Fares(const PlanRequest& request, const BlurLimit& limit, double n, double e) {
  const bool sharp = limit.kind == LimitKind::Sharp;
  LimitAnswer fares;
  fares.limit = {limit.limit.value};
  bool first = true;
  for (const DepthInterval& interval : limit.depths) {
    const OrderedInterval ends = Ordered(interval);
    const Dioptres near = ends.near->vergence(), far = ends.far->vergence();
    if (first || near > fares.near) fares.near = near;
    if (first || far < fares.far) fares.far = far;
    for (const PlanDepth* depth : {ends.near, ends.far}) {
      const double blur = WorstBlurAt(request, limit, *depth, n, e);
      if (!first && (sharp ? blur <= fares.worst.value : blur >= fares.worst.value)) continue;
      first = false;
      fares.worst = {blur};
      fares.at = depth->vergence();
    }
  }
  constexpr double kMostRatio = 1e9;  // no blur at all where there should be some
  fares.ratio = sharp ? fares.worst / fares.limit : std::min(fares.limit / fares.worst, kMostRatio);
  return fares;
}

}  // namespace

LimitAnswer Fare(const PlanRequest& request, const BlurLimit& limit, double n, double e) {
  LimitAnswer fares = Fares(request, limit, n, e);
  fares.name = limit.name;
  return fares;
}

double WorstRatioAt(const PlanRequest& request, double n, double e) {
  double worst = 0.0;
  for (const BlurLimit& limit : request.limits) worst = std::max(worst, Fares(request, limit, n, e).ratio);
  return worst;
}

// Blur is a difference of two terms, |e|/N and f (f + e) U/N, over g; each carries a few ulp, its decimals rounded to
// doubles included. What else enters, enters as a factor.
std::optional<bool> HoldsForCertain(const PlanRequest& request, double n, double e, double worst_ratio) {
  constexpr double kClear = 1e-6, kUlps = 64.0 * std::numeric_limits<double>::epsilon();
  // The objective depth has one limit more, at the focus.
  if (!(std::abs(worst_ratio - 1.0) > kClear) || request.objective == Objective::Depth) return std::nullopt;
  const bool holds = worst_ratio < 1.0;
  const double f = request.focal_length.value, out = std::abs(e) + request.sensor_tolerance.value;
  const double narrow = 1.0 - request.f_number_tolerance.value;
  constexpr double kNarrowest = 1e-3;
  if (narrow < kNarrowest) return std::nullopt;
  const double skew = f * std::abs(1.0 / request.pupil_factor.value - 1.0);
  for (const BlurLimit& limit : request.limits) {
    // Both ends may lie clear of the focal plane and what is between them in it.
    if (holds && limit.kind == LimitKind::Blurred && limit.side == Side::Either) return std::nullopt;
    for (const DepthInterval& interval : limit.depths) {
      for (const PlanDepth* depth : {&interval.one_end, &interval.other_end}) {
        const double u = depth->vergence().value;
        const double g = 1.0 + f * u * (1.0 / request.pupil_factor.value - 1.0);
        const double terms = (out + f * (f + out) * u) * (1.0 + skew * u) / (g * g);
        if (!(kUlps * terms < kClear / 4.0 * n * narrow * limit.limit.value)) return std::nullopt;
      }
    }
  }
  return holds;
}

Metres LiquidExtension(Metres sensor_distance, Metres extension) {
  return {sensor_distance.value * extension.value / (sensor_distance.value - extension.value)};
}

Metres ExtensionOfLiquid(Metres sensor_distance, Metres liquid_extension) {
  return {sensor_distance.value * liquid_extension.value / (sensor_distance.value + liquid_extension.value)};
}

void Describe(const PlanRequest& request, double n, double e, PlanAnswer& answer) {
  const Metres f{request.focal_length.value};
  answer.f_number = {n};
  answer.extension = {e};
  answer.aperture_diameter = ApertureDiameter(f, {n});
  answer.sensor_distance = f + Metres{e};
  answer.focal_plane = FocalPlane(f, {e});
  answer.magnification = Magnification(f, {e});
  answer.working_f_number = WorkingFNumber({n}, answer.magnification, request.pupil_factor.value);
  if (request.liquid) {
    answer.extension = ExtensionOfLiquid(f, {e});
    answer.sensor_distance = f;
    answer.focal_plane = Dioptres{e / (f.value * f.value)};
    answer.magnification = e / f.value;
    answer.working_f_number = {n};
  }
  answer.limits.reserve(request.limits.size());
  for (const BlurLimit& limit : request.limits) {
    LimitAnswer fares = Fare(request, limit, n, e);
    // The verdict is exact; N and e are its nearest doubles, which may touch a limit from the other side.
    constexpr double kRounding = 1.0 + 1e-12;
    if (fares.ratio > 1.0 && fares.ratio <= kRounding) fares.ratio = 1.0;
    answer.worst_ratio = std::max(answer.worst_ratio, fares.ratio);
    answer.limits.push_back(std::move(fares));
  }
}

}  // namespace lensd::optics
