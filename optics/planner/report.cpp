// The figures come from the answer's own N and e, with the bounds of limit_bounds.h; nothing is taken from the solver.
#include "planner/report.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optics/conjugates.h"
#include "optics/light.h"
#include "optics/limit_bounds.h"

namespace lensd::optics {

namespace {

double RatioOf(const BlurLimit& limit, const WorstBlur& worst) {
  constexpr double kMostRatio = 1e9;  // no blur at all where there should be some
  return limit.kind == LimitKind::Sharp ? worst.blur.value / limit.limit.value
                                        : std::min(limit.limit.value / worst.blur.value, kMostRatio);
}

/// How one limit fares at (N, e).
void FillLimitAnswer(const PlanRequest& request, const BlurLimit& limit, double n, double e, LimitAnswer& answer) {
  const WorstBlur worst = WorstBlurOf(request, limit, {n}, {e});
  answer.name = limit.name;
  answer.near = answer.far = limit.depths.front().one_end.vergence();
  answer.limit = {limit.limit.value};
  answer.worst = worst.blur;
  answer.at = worst.at->vergence();
  answer.ratio = RatioOf(limit, worst);
  for (const DepthInterval& interval : limit.depths) {
    const Dioptres one = interval.one_end.vergence(), other = interval.other_end.vergence();
    answer.near = std::max(answer.near, std::max(one, other));
    answer.far = std::min(answer.far, std::min(one, other));
  }
}

}  // namespace

Metres LiquidExtension(Metres sensor_distance, Metres extension) {
  return {sensor_distance.value * extension.value / (sensor_distance.value - extension.value)};
}

Metres ExtensionOfLiquid(Metres sensor_distance, Metres liquid_extension) {
  return {sensor_distance.value * liquid_extension.value / (sensor_distance.value + liquid_extension.value)};
}

void Describe(const PlanRequest& request, double n, double e, PlanAnswer& answer) {
  const Metres f{request.focal_length.value};
  answer.f_number = {n};
  answer.focal_length = f;
  answer.extension = {e};
  answer.aperture_diameter = ApertureDiameter(f, {n});
  answer.sensor_distance = f + Metres{e};
  answer.focal_plane = FocalPlane(f, {e});
  answer.magnification = Magnification(f, {e});
  answer.working_f_number = WorkingFNumber({n}, answer.magnification, request.pupil_factor.value);
  if (request.liquid) {
    answer.extension = ExtensionOfLiquid(f, {e});
    answer.focal_length = f - answer.extension;
    answer.sensor_distance = f;
    answer.focal_plane = Dioptres{e / (f.value * f.value)};
    answer.magnification = e / f.value;
    answer.working_f_number = {n};
  }
  if (!request.wavelength && !request.liquid) {
    constexpr Metres kGreen{550e-9};
    answer.diffraction = DiffractionBlur(request.diffraction, kGreen, answer.working_f_number);
  }
  answer.limits.clear();
  answer.worst_ratio = 0.0;
  answer.limits.reserve(request.limits.size());
  for (const BlurLimit& limit : request.limits) {
    LimitAnswer& fares = answer.limits.emplace_back();
    FillLimitAnswer(request, limit, n, e, fares);
    // The verdict is exact; N and e are its nearest doubles, which may touch a limit from the other side.
    constexpr double kRounding = 1.0 + 1e-12;
    if (fares.ratio > 1.0 && fares.ratio <= kRounding) fares.ratio = 1.0;
    answer.worst_ratio = std::max(answer.worst_ratio, fares.ratio);
  }
}

}  // namespace lensd::optics
