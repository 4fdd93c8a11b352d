// The planner's programmes in exact arithmetic: what double precision cannot decide. Decimals become rationals, the
// verdict and N stay rational; ratios hold square roots and are worked out to 100 digits.
#include "optics/planner/solve_exact.h"

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>

#include "optics/planner/branch_and_bound.h"
#include "optics/planner/exact_number.h"

namespace lensd::optics {

namespace {

namespace mp = boost::multiprecision;
using Real = mp::number<mp::cpp_bin_float<100>, mp::et_off>;

Real ToReal(const Rational& rational) {
  return Real(mp::numerator(rational)) / Real(mp::denominator(rational));
}

double ToDouble(const Real& real) {
  return real.convert_to<double>();
}

void Copy(std::span<const Rational> from, std::span<Real> to) {
  std::ranges::transform(from, to.begin(), ToReal);
}

/// The same programme in Real. Each number is rounded once, so that what was equal stays equal.
void Copy(const LinearProgram<Rational>& from, LinearProgram<Real>& to) {
  to.Resize(from.upper_p.size(), from.lower_p.size());
  Copy(from.upper_p, to.upper_p);
  Copy(from.upper_q, to.upper_q);
  Copy(from.lower_p, to.lower_p);
  Copy(from.lower_q, to.lower_q);
  to.Use(from.strip.upper.sharp, from.strip.lower.sharp);
  to.strip.low = ToReal(from.strip.low);
  to.strip.high = ToReal(from.strip.high);
  to.strip.n_low = ToReal(from.strip.n_low);
  to.strip.n_high = ToReal(from.strip.n_high);
  to.strip.high_unbounded = from.strip.high_unbounded;
  to.lens = {ToReal(from.lens.f),     ToReal(from.lens.delta), ToReal(from.lens.pupil), ToReal(from.lens.narrow),
             ToReal(from.lens.widen), from.lens.liquid,        ToReal(from.lens.skew)};
  std::ranges::copy(from.upper_name, to.upper_name.begin());
  std::ranges::copy(from.lower_name, to.lower_name.begin());
  to.low_name = from.low_name;
  to.high_name = from.high_name;
  if (from.strip.cap) to.strip.cap = ToReal(*from.strip.cap);
}

Number ToNumber(const Decimal& decimal) {
  return {decimal.Nearest().value_or(decimal.IsZero() ? 0.0 : HUGE_VAL), decimal.Text()};
}

Decimal Magnitude(const Decimal& decimal) {
  return decimal.IsNegative() ? -decimal : decimal;
}

}  // namespace

Solution SolveRowsExactly(const Subproblem& task, WantedN wanted) {
  const bool largest = wanted == WantedN::Largest;
  LinearProgram<Rational> programme;
  Write(programme, task, RationalOf);
  Solution solved;
  SmallestNResult<Rational> result;
  if (!programme.unmeetable && !programme.focus_outside) {
    std::vector<Rational> storage;
    result = SmallestN(largest ? Mirrored(programme.strip, storage) : programme.strip);
  }
  if (!result.feasible) {
    solved.names = NamesOf(programme, result);
    return solved;
  }
  solved.feasible = true;
  const Rational n = largest ? Rational(-result.n) : result.n;
  solved.n = ToDouble(ToReal(n));
  if (!(n > 0) || programme.strip.high_unbounded) return solved;
  LinearProgram<Real> fine;
  Copy(programme, fine);
  const std::optional<LeastRatio<Real>> least = LeastRatioAt(fine.strip, ToReal(n));
  if (!least) return solved;
  solved.e = ToDouble(least->e);
  solved.ratio = ToDouble(least->ratio);
  return solved;
}

std::optional<Solution> SolveForRatioExactly(const Subproblem& task) {
  LinearProgram<Rational> programme;
  Write(programme, task, RationalOf);
  if (programme.unmeetable || programme.focus_outside) return std::nullopt;
  LinearProgram<Real> fine;
  Copy(programme, fine);
  const std::optional<LeastRatio<Real>> least = LeastRatioOver(fine.strip);
  if (!least) return std::nullopt;
  return Solution{true, ToDouble(least->n), ToDouble(least->e), ToDouble(least->ratio), {}, false};
}

Solution SolveDiffractedExactly(const Subproblem& task, const Solution& without) {
  const PlanRequest& request = *task.request;
  LinearProgram<Rational> programme;
  Write(programme, task, RationalOf);
  LinearProgram<Real> lines;
  Copy(programme, lines);
  const auto to_real = [](const Number& number) { return ToReal(RationalOf(number)); };
  const Real factor = Real(std::lround(DiffractionFactor(request.diffraction) * 100)) / 100;
  const DiffractionStrip<Real> strip = WriteCurves(lines, task, Real(factor * to_real(*request.wavelength)), to_real);
  Real end = lines.strip.n_high;
  for (const SharpCurve<Real>& curve : strip.curves) {
    const Real useful = curve.limit / (curve.stretch * strip.k * (lines.lens.f + lines.strip.low / lines.lens.pupil));
    if (&curve == strip.curves.data() && programme.strip.n_unbounded) end = useful;
    end = std::min(end, useful);
  }
  const Real tiny("1e-30"), tolerance("1e-80");
  Solution solved;
  Real start = lines.strip.n_low;
  if (start < Real(without.n) * Real("0.999999")) start = Real(without.n) * Real("0.999999");
  if (start < tiny * end) start = tiny * end;
  DiffractionSearch<Real> search;
  solved.scanned = !IsConvexUpTo(strip, end, Real(1));
  search = solved.scanned ? SmallestNByScan(strip, start, end, Real(1), tolerance)
                          : SmallestNConvex(strip, start, end, tolerance);
  if (lines.strip.cap && search.n > *lines.strip.cap) search.feasible = false;
  solved.undecided = search.undecided;
  if (!search.feasible) {
    solved.names = without.names;
    for (const LimitRow& row : task.rows) solved.names.push_back(row.name);
    for (const int name : {kFocusName, kFNumberName, kExtensionName}) solved.names.push_back(name);
    return solved;
  }
  solved.feasible = true;
  solved.n = ToDouble(search.n);
  if (lines.strip.high_unbounded) return solved;
  if (const auto least = DiffractionRatioAt(strip, search.n, Real("1e-40"))) {
    solved.e = ToDouble(least->e);
    solved.ratio = ToDouble(least->ratio);
  }
  return solved;
}

int CompareFocalPower(const Number& focal_length, const PlanDepth& depth) {
  const Rational f = RationalOf(focal_length);
  const Rational value = RationalOf(depth.number);
  return depth.is_vergence ? Rational(f * value).compare(1) : f.compare(value);
}

Result<DepthInterval> DepthsOfPlane(const Number& u0, const Number& ux, const Number& uy) {
  for (const Number* number : {&u0, &ux, &uy}) {
    if (!std::isfinite(number->value)) return Fail(Code::InvalidArgument, "a plane's vergences must be finite numbers");
  }
  const Decimal centre = DecimalOf(u0);
  const Decimal half = Magnitude(DecimalOf(ux)) + Magnitude(DecimalOf(uy));
  const Decimal near = centre + half, far = centre - half;
  if (near.IsNegative()) {
    return Fail(Code::OutOfRange, "the plane lies past infinity over the whole frame: raise its vergence U0");
  }
  return DepthInterval{PlanDepth::Vergence(ToNumber(near)),
                       PlanDepth::Vergence(far.IsNegative() ? Number(0.0) : ToNumber(far))};
}

}  // namespace lensd::optics
