// A shot at e has a diffraction disk k λ N (1 + e/(f p)). With t = (e - a)/(f p + a), so that geometric blur is f p
// t/N, a limit c reads (G² + H²) t² + 2 H² t + H² - c² <= 0, where G = f p/N and H = k λ N (1 + a/(f p)).
#include "stack_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::optics {

double StretchReach::HighestFor(double a, double limit) const {
  double highest = std::numeric_limits<double>::infinity();
  for (const double scaled : Scales()) highest = std::min(highest, Highest(a, limit, scaled));
  return highest - lens_.delta;
}

double StretchReach::LowestFor(double a, double limit) const {
  double lowest = -std::numeric_limits<double>::infinity();
  for (const double scaled : Scales()) lowest = std::max(lowest, Lowest(a, limit, scaled));
  return lowest + lens_.delta;
}

std::optional<double> StretchReach::NearestAt(double e, double limit) const {
  double part = std::numeric_limits<double>::infinity();
  for (const double scaled : Scales()) part = std::min(part, Part(e - lens_.delta, limit, scaled));
  if (!(part < 1.0)) return std::nullopt;
  return (e - lens_.delta + part * lens_.scale) / (1.0 - part);
}

double StretchReach::FarthestAt(double e, double limit) const {
  double part = std::numeric_limits<double>::infinity();
  for (const double scaled : Scales()) part = std::min(part, Part(e + lens_.delta, limit, scaled));
  return (e + lens_.delta - part * lens_.scale) / (1.0 + part);
}

/// The f-number's own tolerance: geometric blur is worst at the smallest, diffraction at the largest.
std::vector<double> StretchReach::Scales() const {
  if (lens_.airy == 0.0) return {1.0 - lens_.epsilon};
  return lens_.epsilon == 0.0 ? std::vector{1.0} : std::vector{1.0 - lens_.epsilon, 1.0 + lens_.epsilon};
}

/// The two roots t at one f-number; both NaN where diffraction alone exceeds the limit.
std::pair<double, double> StretchReach::Roots(double a, double limit, double n) const {
  const double g = lens_.scale / n;
  const double h = lens_.airy * n * (1.0 + a / lens_.scale);
  if (h == 0.0) return {-limit / g, limit / g};
  const double sum = g * g + h * h;
  const double root = std::sqrt(limit * limit * sum - g * g * h * h);
  return {(-h * h - root) / sum, (-h * h + root) / sum};
}

double StretchReach::Highest(double a, double limit, double scaled) const {
  double t = -1.0;
  for (const double n : Candidates(a, limit, scaled, 1.0)) t = std::max(t, Roots(a, limit, n).second);
  return a + (lens_.scale + a) * t;
}

double StretchReach::Lowest(double a, double limit, double scaled) const {
  double t = std::numeric_limits<double>::infinity();
  for (const double n : Candidates(a, limit, scaled, -1.0)) t = std::min(t, Roots(a, limit, n).first);
  return a + (lens_.scale + a) * t;
}

/// Both ends of the stretch, and between them the f-number that reaches farthest up (side 1) or down (side -1): where
/// geometric blur and diffraction are both c/√2, k λ y N (1 ± c N/(√2 f p)) = c/√2 with y = 1 + a/(f p).
std::vector<double> StretchReach::Candidates(double a, double limit, double scaled, double side) const {
  const double low = low_ * scaled;
  const double high = high_ * scaled;
  if (low == high || lens_.airy == 0.0) return {low, high};
  const double share = limit / std::sqrt(2.0);
  const double linear = lens_.airy * (1.0 + a / lens_.scale);
  const double root = std::sqrt(linear * linear + side * 4.0 * share * share * linear / lens_.scale);
  const double best = 2.0 * share / (linear + root);
  return {low, high, std::isnan(best) ? high : std::clamp(best, low, high)};
}

/// The largest c' N/(f p) over the stretch, c' being what diffraction at extension e leaves of the limit.
double StretchReach::Part(double e, double limit, double scaled) const {
  const double disk = lens_.airy * (1.0 + e / lens_.scale);
  const auto part = [&](double n) {
    return std::sqrt(std::max(0.0, (limit - disk * n) * (limit + disk * n))) * n / lens_.scale;
  };
  const double low = low_ * scaled;
  const double high = high_ * scaled;
  double most = std::max(part(low), part(high));
  if (disk > 0.0) most = std::max(most, part(std::clamp(limit / (std::sqrt(2.0) * disk), low, high)));
  return most;
}

}  // namespace lensd::optics
