// The greedy cover of stack_cover.h on rational numbers, at one f-number and without diffraction.
#include "optics/stack/stack_exact.h"

#include <cmath>

#include "optics/planner/exact_number.h"

namespace lensd::optics {
namespace {

Rational ConjugateExtension(const Rational& f, const PlanDepth& depth) {
  if (!depth.is_vergence && std::isinf(depth.number.value)) return 0;
  const Rational value = RationalOf(depth.number);
  return depth.is_vergence ? Rational(f * f * value / (1 - f * value)) : Rational(f * f / (value - f));
}

}  // namespace

Cover<double> ExactCover(const PlanRequest& request, const Number& stop) {
  const Rational f = RationalOf(request.focal_length);
  std::vector<Need<Rational>> needs;
  for (const BlurLimit& limit : request.limits) {
    for (const DepthInterval& depths : limit.depths) {
      const Rational one = ConjugateExtension(f, depths.one_end);
      const Rational other = ConjugateExtension(f, depths.other_end);
      needs.push_back({std::min(one, other), std::max(one, other), RationalOf(limit.limit)});
    }
  }
  const Rational value = RationalOf(stop);
  const Rational n = request.apertures_are_diameters ? Rational(f / value) : value;
  const GeometricReach<Rational> reach{f * RationalOf(request.pupil_factor), RationalOf(request.sensor_tolerance),
                                       n * (1 - RationalOf(request.f_number_tolerance))};
  const auto cover =
      GreedyCover(Disjoint(needs), reach, RationalOf(request.extensions.low), RationalOf(request.extensions.high));
  Cover<double> rounded{cover.end, {}, {}, cover.need};
  for (const Rational& e : cover.extensions) rounded.extensions.push_back(e.convert_to<double>());
  for (const Rational& a : cover.forced_by) rounded.forced_by.push_back(a.convert_to<double>());
  return rounded;
}

}  // namespace lensd::optics
