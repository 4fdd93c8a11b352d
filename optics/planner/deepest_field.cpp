// Without diffraction both ends of the field move out with N. With it, blur c leaves g(N) = N √(c² - k² N² L²) of
// geometric reach, largest at N = c/(√2 k L) with L = f + e/p. The near end is ruled by e - δ and the far end by e + δ,
// so the best N lies between their two, found there by the sign of the derivative. Under a tolerance ε of the f-number
// the smaller of g(N (1 - ε)) and g(N (1 + ε)) counts, largest where they are equal.
#include "optics/planner/deepest_field.h"

#include <algorithm>
#include <cmath>

#include "optics/planner/diffraction_curves.h"

namespace lensd::optics {

namespace {

class Field {
 public:
  explicit Field(const PlanRequest& request)
      : f_(request.focal_length.value),
        liquid_(request.liquid),
        pupil_(request.pupil_factor.value),
        skew_(f_ * (1.0 / pupil_ - 1.0)),
        delta_(request.sensor_tolerance.value),
        limit_(request.depth_limit->value),
        narrow_(1.0 - request.f_number_tolerance.value),
        widen_(1.0 + request.f_number_tolerance.value),
        k_(request.wavelength ? DiffractionFactor(request.diffraction) * request.wavelength->value / f_ : 0.0) {}

  FieldDepth At(double n, double e) const {
    const double near = std::min(Near(n, e - delta_), Near(n, e + delta_));
    const double far = std::max(Far(n, e - delta_), Far(n, e + delta_));
    return {near, std::max(far, 0.0)};
  }

  /// Sign of the derivative of the field's width over N.
  bool Widens(double n, double e) const {
    const double in = e - delta_, out = e + delta_;
    const double near_base = f_ * (f_ + in) - Reach(n, in) * skew_;
    const double near_slope = ReachSlope(n, in) * (f_ * (f_ + in) + in * skew_) / (near_base * near_base);
    const double far_base = f_ * (f_ + out) + Reach(n, out) * skew_;
    const double far_slope = ReachSlope(n, out) * (f_ * (f_ + out) + out * skew_) / (far_base * far_base);
    return near_slope + (Far(n, out) > 0.0 ? far_slope : 0.0) > 0.0;
  }

  /// Where the reach is largest.
  double Best(double e) const { return limit_ / (std::hypot(narrow_, widen_) * k_ * (f_ + e / pupil_)); }
  double delta() const { return delta_; }

 private:
  double Left(double n, double e) const {
    const double diffraction = k_ * n * (f_ + e / pupil_);
    return std::max(limit_ * limit_ - diffraction * diffraction, 0.0);
  }
  /// g at one f-number.
  double ReachOf(double n, double e) const { return n * std::sqrt(Left(n, e)); }
  double Stretch(double n, double e) const {
    return ReachOf(n * widen_, e) < ReachOf(n * narrow_, e) ? widen_ : narrow_;
  }
  double Reach(double n, double e) const { return ReachOf(n * Stretch(n, e), e); }
  double ReachSlope(double n, double e) const {
    const double stretch = Stretch(n, e), left = Left(n * stretch, e);
    return stretch * (2.0 * left - limit_ * limit_) / std::sqrt(std::max(left, 1e-300));
  }
  double Base(double e) const { return f_ * (liquid_ ? f_ : f_ + e); }
  double Near(double n, double e) const { return (e + Reach(n, e)) / (Base(e) - Reach(n, e) * skew_); }
  double Far(double n, double e) const { return (e - Reach(n, e)) / (Base(e) + Reach(n, e) * skew_); }

  double f_;
  bool liquid_;
  double pupil_, skew_, delta_, limit_, narrow_, widen_, k_;
};

/// Largest N at which one curve still holds at extension e: a quadratic in N².
double LargestN(const SharpCurve<double>& curve, const LensNumbers<double>& lens, double k, double e) {
  const double s = curve.w * e - lens.f * curve.m, kl = k * (lens.f + e / lens.pupil);
  const double c2 = curve.limit * curve.limit;
  return std::sqrt((c2 + std::sqrt(std::max(c2 * c2 - 4.0 * kl * kl * s * s, 0.0))) / 2.0) / (kl * curve.stretch);
}

}  // namespace

FieldDepth FieldDepthAt(const PlanRequest& request, double n, double e) {
  return Field(request).At(n, e);
}

double DeepestN(const Subproblem& task, double n, double e) {
  const PlanRequest& request = *task.request;
  const auto to_double = [](const Number& number) { return number.value; };
  LinearProgram<double> lines;
  Write(lines, task, to_double);
  double most = lines.strip.n_high;
  for (std::size_t i = lines.strip.upper.sharp; i < lines.upper_p.size(); ++i) {
    most = std::min(most, (e - lines.upper_p[i]) / lines.upper_q[i]);
  }
  for (std::size_t i = lines.strip.lower.sharp; i < lines.lower_p.size(); ++i) {
    most = std::min(most, (e - lines.lower_p[i]) / lines.lower_q[i]);
  }
  if (lines.strip.cap) most = std::min(most, *lines.strip.cap);
  const double factor = DiffractionFactor(request.diffraction) * request.wavelength->value;
  const DiffractionStrip<double> strip = WriteCurves(lines, task, factor, to_double);
  const Field field(request);
  for (const SharpCurve<double>& curve : strip.curves) {
    for (const double shift : {-field.delta(), field.delta()}) {
      most = std::min(most, LargestN(curve, lines.lens, strip.k, e + shift));
    }
  }
  double low = field.Best(e + field.delta()), high = field.Best(e - field.delta());
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings && low < high; ++i) {
    const double middle = (low + high) / 2.0;
    (field.Widens(middle, e) ? low : high) = middle;
  }
  return std::max(n, std::min(low, most));
}

}  // namespace lensd::optics
