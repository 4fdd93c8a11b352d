// Coin-OR's Clp as a peer: the plan as a linear programme, solved by the dual simplex method.
#include "bench/plan/peers.h"

#ifdef LENSD_HAVE_CLP
#include <coin/ClpSimplex.hpp>
#include <coin/CoinPackedMatrix.hpp>
#include <limits>
#include <memory>

namespace lensd::bench {
namespace {

constexpr double kScale = 1e3;  // extensions in millimetres

/// Minimise N over rows p <= e - q N (lower lines) and e - q N <= p (upper lines).
Answer Solve(const Problem& problem) {
  const Lines lines = LinesOf(problem);
  const std::size_t uppers = lines.upper_p.size();
  const std::size_t rows = uppers + lines.lower_p.size();
  std::vector<double> elements(2 * rows);
  std::vector<int> index(2 * rows);
  std::vector<double> row_low(rows, -COIN_DBL_MAX);
  std::vector<double> row_high(rows, COIN_DBL_MAX);
  for (std::size_t i = 0; i < rows; ++i) {
    const bool upper = i < uppers;
    const double p = kScale * (upper ? lines.upper_p[i] : lines.lower_p[i - uppers]);
    elements[i] = -kScale * (upper ? lines.upper_q[i] : lines.lower_q[i - uppers]);
    elements[rows + i] = 1.0;
    index[i] = index[rows + i] = static_cast<int>(i);
    (upper ? row_high : row_low)[i] = p;
  }
  const CoinBigIndex starts[] = {0, static_cast<CoinBigIndex>(rows), static_cast<CoinBigIndex>(2 * rows)};
  const double low[] = {problem.n_low, kScale * problem.e_low};
  const double high[] = {problem.n_high, kScale * problem.e_high};
  const double cost[] = {1.0, 0.0};
  ClpSimplex simplex;
  simplex.setLogLevel(0);
  simplex.loadProblem(2, static_cast<int>(rows), starts, index.data(), elements.data(), low, high, cost, row_low.data(),
                      row_high.data());
  simplex.dual();
  if (!simplex.isProvenOptimal()) {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }
  const double* x = simplex.primalColumnSolution();
  return {x[0], x[1] / kScale};
}

}  // namespace

Method ClpDual() {
  return {"Clp dual simplex", [](const Problem& problem) -> Solver { return [&problem] { return Solve(problem); }; },
          10'000'000};
}

}  // namespace lensd::bench
#else
namespace lensd::bench {

Method ClpDual() {
  return {"Clp dual simplex", {}, 0, "coinor-libclp-dev"};
}

}  // namespace lensd::bench
#endif
