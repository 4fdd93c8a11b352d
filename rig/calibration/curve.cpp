// Boost's monotone cubic (PCHIP) between the points, straight lines beyond them. The inverse is found by bracketing,
// for which the curve has to rise or fall throughout.
#include "rig/calibration/curve.h"

#include <math.h>  // pchip.hpp of Boost 1.74 calls isnan() unqualified

#include <algorithm>
#include <boost/math/interpolators/pchip.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <numeric>
#include <utility>

namespace lensd::rig {
namespace {

constexpr std::size_t kLeastKnots = 4;  // that pchip takes
constexpr int kMostDoublings = 60;

/// More knots on the straight lines between few: two or three points say nothing about curvature.
std::vector<Curve::Knot> Refined(std::vector<Curve::Knot> knots) {
  while (knots.size() < kLeastKnots) {
    std::vector<Curve::Knot> finer = {knots.front()};
    for (std::size_t i = 1; i < knots.size(); ++i) {
      const Curve::Knot &a = knots[i - 1], &b = knots[i];
      finer.push_back({std::midpoint(a.at, b.at), std::midpoint(a.value, b.value)});
      finer.push_back(b);
    }
    knots = std::move(finer);
  }
  return knots;
}

/// Not by the product, which may vanish; numbers that are none are on no side of 0 that a search could leave.
bool SameSide(double a, double b) {
  return std::isnan(a) || std::isnan(b) || (a > 0.0) == (b > 0.0);
}

double SlopeBetween(const Curve::Knot& a, const Curve::Knot& b) {
  return (b.value - a.value) / (b.at - a.at);
}

/// Neighbours so close, or so far apart, that no number says how the curve runs between them.
bool SayHowItRuns(const Curve::Knot& a, const Curve::Knot& b) {
  const double slope = SlopeBetween(a, b);
  return a.at < b.at && std::isfinite(slope) && (a.value == b.value || std::isnormal(slope));
}

}  // namespace

Result<Curve> Curve::Through(const std::vector<Knot>& given) {
  if (given.size() < 2) return Fail(Code::InvalidArgument, "a curve needs at least two points");
  for (const Knot& knot : given) {
    if (!std::isfinite(knot.at) || !std::isfinite(knot.value)) {
      return Fail(Code::InvalidArgument, "every point must be finite");
    }
  }
  Curve curve;
  curve.rising_ = curve.falling_ = true;
  for (std::size_t i = 1; i < given.size(); ++i) {
    if (!(given[i - 1].at < given[i].at)) return Fail(Code::InvalidArgument, "positions must rise from point to point");
    curve.rising_ &= given[i - 1].value < given[i].value;
    curve.falling_ &= given[i - 1].value > given[i].value;
  }
  const std::vector<Knot> knots = Refined(given);
  for (std::size_t i = 1; i < knots.size(); ++i) {
    if (SayHowItRuns(knots[i - 1], knots[i])) continue;
    return Fail(Code::InvalidArgument, "two points are too close together, or too far apart, for a curve");
  }
  curve.first_ = knots.front();
  curve.last_ = knots.back();
  curve.first_slope_ = SlopeBetween(knots[0], knots[1]);
  curve.last_slope_ = SlopeBetween(knots[knots.size() - 2], knots.back());
  std::vector<double> x, y;
  for (const Knot& knot : knots) {
    x.push_back(knot.at);
    y.push_back(knot.value);
  }
  curve.between_ = std::make_shared<const std::function<double(double)>>(
      boost::math::interpolators::pchip<std::vector<double>>(std::move(x), std::move(y)));
  return curve;
}

double Curve::At(double x) const {
  if (x <= first_.at) return first_.value + first_slope_ * (x - first_.at);
  if (!(x < last_.at)) return last_.value + last_slope_ * (x - last_.at);
  return (*between_)(x);
}

double Curve::Inverse(double value) const {
  return SolveMonotone([this](double x) { return At(x); }, value, first_.at, last_.at);
}

double SolveMonotone(const std::function<double(double)>& f, double value, double low, double high) {
  const auto off = [&](double x) { return f(x) - value; };
  double at_low = off(low), at_high = off(high);
  for (int i = 0; i < kMostDoublings && SameSide(at_low, at_high); ++i) {
    const double span = high - low;
    const bool beyond_high = std::abs(at_high) < std::abs(at_low);
    (beyond_high ? high : low) += beyond_high ? span : -span;
    (beyond_high ? at_high : at_low) = off(beyond_high ? high : low);
  }
  if (at_low == 0.0) return low;
  if (at_high == 0.0) return high;
  if (SameSide(at_low, at_high)) return std::abs(at_high) < std::abs(at_low) ? high : low;
  std::uintmax_t steps = 200;
  const auto tight = boost::math::tools::eps_tolerance<double>(52);
  using namespace boost::math::policies;
  const policy<evaluation_error<ignore_error>, domain_error<ignore_error>> no_throw;
  const auto [a, b] = boost::math::tools::toms748_solve(off, low, high, at_low, at_high, tight, steps, no_throw);
  return std::abs(off(a)) <= std::abs(off(b)) ? a : b;
}

}  // namespace lensd::rig
