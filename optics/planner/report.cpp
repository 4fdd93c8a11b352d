// The figures come from the answer's own N and e, with the bounds of limit_bounds.h; nothing is taken from the solver.
#include "optics/planner/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "optics/conjugates.h"
#include "optics/light.h"
#include "optics/limit_bounds.h"

namespace lensd::optics {

namespace {

/// Adds how one limit fares.
void AddLimitAnswer(const WorstBlurs& blurs, const BlurLimit& limit, PlanAnswer& answer) {
  const WorstBlur worst = blurs.Of(limit);
  constexpr std::array<double, 2> kMostRatio{std::numeric_limits<double>::infinity(), 1e9};  // 1e9: no blur at all
  const auto kind = static_cast<std::size_t>(limit.kind);  // as an index: a choice that no processor guesses
  const std::array<double, 3> sizes{worst.blur.value, limit.limit.value, worst.blur.value};
  double ratio = std::min(sizes[kind] / sizes[kind + 1], kMostRatio[kind]);
  // The verdict is exact; N and e are its nearest doubles, which may touch a limit from the other side.
  constexpr double kRounding = 1.0 + 1e-12;
  if (ratio > 1.0 && ratio <= kRounding) ratio = 1.0;
  double near = -std::numeric_limits<double>::infinity(), far = -near;
  for (const DepthInterval& interval : limit.depths) {
    const double one = interval.one_end.vergence().value, other = interval.other_end.vergence().value;
    near = std::max(near, std::max(one, other));
    far = std::min(far, std::min(one, other));
  }
  answer.worst_ratio = std::max(answer.worst_ratio, ratio);
  answer.limits.emplace_back(Dioptres{near}, Dioptres{far}, Metres{limit.limit.value}, worst.blur, worst.at->vergence(),
                             ratio);
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
  const WorstBlurs blurs(request, {n}, {e});
  for (const BlurLimit& limit : request.limits) AddLimitAnswer(blurs, limit, answer);
}

}  // namespace lensd::optics
