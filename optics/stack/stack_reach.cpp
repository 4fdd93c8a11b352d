// A shot at e has a diffraction disk k λ N (1 + e/(f p)). With t = (e - a)/(f p + a), so that geometric blur is f p
// t/N, a limit c reads (G² + H²) t² + 2 H² t + H² - c² <= 0, where G = f p/N and H = k λ N (1 + a/(f p)).
#include "optics/stack/stack_reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensd::optics {

StretchReach::StretchReach(const StackLens& lens, double n_low, double n_high) : lens_(lens) {
  // The f-number's own tolerance: geometric blur is worst at its low end, diffraction at its high end.
  stretches_[0] = {n_low * (1.0 - lens.epsilon), n_high * (1.0 - lens.epsilon)};
  if (lens.airy > 0.0 && lens.epsilon > 0.0)
    stretches_[1] = {n_low * (1.0 + lens.epsilon), n_high * (1.0 + lens.epsilon)};
}

double StretchReach::HighestFor(double a, double limit) const {
  double t = Root(stretches_[0], a, limit, 1.0);
  if (stretches_[1]) t = std::min(t, Root(stretches_[1], a, limit, 1.0));
  return a + (lens_.scale + a) * t - lens_.delta;
}

double StretchReach::LowestFor(double a, double limit) const {
  double t = Root(stretches_[0], a, limit, -1.0);
  if (stretches_[1]) t = std::max(t, Root(stretches_[1], a, limit, -1.0));
  return a + (lens_.scale + a) * t + lens_.delta;
}

std::optional<double> StretchReach::NearestAt(double e, double limit) const {
  const double part = Part(e - lens_.delta, limit);
  if (!(part < 1.0)) return std::nullopt;
  return (e - lens_.delta + part * lens_.scale) / (1.0 - part);
}

double StretchReach::FarthestAt(double e, double limit) const {
  const double part = Part(e + lens_.delta, limit);
  return (e + lens_.delta - part * lens_.scale) / (1.0 + part);
}

/// The upper (side 1) or lower (side -1) root t at one f-number; NaN where diffraction alone exceeds the limit.
double StretchReach::RootAt(double n, double a, double limit, double side) const {
  const double g = lens_.scale / n;
  if (lens_.airy == 0.0) return side * limit / g;
  const double h = lens_.airy * n * (1.0 + a / lens_.scale);
  const double sum = g * g + h * h;
  return (side * std::sqrt(limit * limit * sum - g * g * h * h) - h * h) / sum;
}

/// The root that reaches farthest over the stretch: at an end, or between them where geometric blur and diffraction are
/// both c/√2, that is k λ y N (1 ± c N/(√2 f p)) = c/√2 with y = 1 + a/(f p).
double StretchReach::Root(const Stretch& stretch, double a, double limit, double side) const {
  const double at_high = RootAt(stretch.high, a, limit, side);
  if (stretch.low == stretch.high) return at_high;
  double farthest = side * std::max(side * RootAt(stretch.low, a, limit, side), side * at_high);
  if (lens_.airy == 0.0) return farthest;
  const double share = limit * std::numbers::sqrt2 / 2.0;
  const double linear = lens_.airy * (1.0 + a / lens_.scale);
  const double root = std::sqrt(linear * linear + side * 4.0 * share * share * linear / lens_.scale);
  const double best = 2.0 * share / (linear + root);
  if (best > stretch.low && best < stretch.high) {
    farthest = side * std::max(side * farthest, side * RootAt(best, a, limit, side));
  }
  return farthest;
}

/// The largest c' N/(f p) over the stretch, c' being what diffraction at extension e leaves of the limit.
double StretchReach::Part(double e, double limit) const {
  const double disk = lens_.airy * (1.0 + e / lens_.scale);
  const auto part = [&](double n) {
    return std::sqrt(std::max(0.0, (limit - disk * n) * (limit + disk * n))) * n / lens_.scale;
  };
  const auto largest = [&](const Stretch& stretch) {
    const double best = disk > 0.0 ? limit / (std::numbers::sqrt2 * disk) : stretch.high;
    return part(std::clamp(best, stretch.low, stretch.high));
  };
  const double first = largest(stretches_[0]);
  return stretches_[1] ? std::min(first, largest(stretches_[1])) : first;
}

}  // namespace lensd::optics
