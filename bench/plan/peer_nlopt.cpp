// NLopt's SLSQP as a peer: the plan as a smooth problem with inequality constraints.
#include "bench/plan/peers.h"

#ifdef LENSD_HAVE_NLOPT
#include <nlopt.h>

#include <cmath>
#include <limits>

namespace lensd::bench {
namespace {

constexpr double kScale = 5e4;  // extensions in units of 20 um, so that a step in either unknown weighs alike

double Objective(unsigned, const double* x, double* gradient, void*) {
  if (gradient != nullptr) gradient[0] = 1, gradient[1] = 0;
  return x[0];
}

/// Each line as "what exceeds it" <= 0.
void Excess(unsigned, double* result, unsigned, const double* x, double* gradient, void* data) {
  const Lines& lines = *static_cast<const Lines*>(data);
  std::size_t row = 0;
  const auto put = [&](double p, double q, double side) {
    result[row] = side * (x[1] - kScale * (p + q * x[0]));
    if (gradient != nullptr) gradient[2 * row] = -side * kScale * q, gradient[2 * row + 1] = side;
    ++row;
  };
  for (std::size_t i = 0; i < lines.upper_p.size(); ++i) put(lines.upper_p[i], lines.upper_q[i], 1);
  for (std::size_t i = 0; i < lines.lower_p.size(); ++i) put(lines.lower_p[i], lines.lower_q[i], -1);
}

Answer Solve(const Problem& problem) {
  Lines lines = LinesOf(problem);
  const auto rows = static_cast<unsigned>(lines.upper_p.size() + lines.lower_p.size());
  nlopt_opt opt = nlopt_create(NLOPT_LD_SLSQP, 2);
  const double low[] = {problem.n_low, kScale * problem.e_low};
  const double high[] = {problem.n_high, kScale * problem.e_high};
  nlopt_set_lower_bounds(opt, low);
  nlopt_set_upper_bounds(opt, high);
  nlopt_set_min_objective(opt, Objective, nullptr);
  nlopt_add_inequality_mconstraint(opt, rows, Excess, &lines, nullptr);
  nlopt_set_xtol_rel(opt, 1e-14);
  nlopt_set_maxeval(opt, 200);
  double x[] = {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])};
  double value = 0;
  const nlopt_result result = nlopt_optimize(opt, x, &value);
  nlopt_destroy(opt);
  if (result < 0 && result != NLOPT_ROUNDOFF_LIMITED) {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }
  return {x[0], x[1] / kScale};
}

}  // namespace

Method NloptSlsqp() {
  return {"NLopt SLSQP", [](const Problem& problem) -> Solver { return [&problem] { return Solve(problem); }; }, 1000};
}

}  // namespace lensd::bench
#else
namespace lensd::bench {

Method NloptSlsqp() {
  return {"NLopt SLSQP", {}, 0, "libnlopt-dev"};
}

}  // namespace lensd::bench
#endif
