// Wilson intervals of shares, order statistics of medians.
#include "bench/evidence/statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lensd::bench {

Estimate ShareOf(int hits, int runs) {
  constexpr double kZ = 1.959963984540054;  // 97.5 % point of the normal distribution
  const double n = runs, share = hits / n;
  const double middle = share + kZ * kZ / (2 * n);
  const double width = kZ * std::sqrt(share * (1 - share) / n + kZ * kZ / (4 * n * n));
  const double scale = 1 + kZ * kZ / n;
  // At the ends the interval touches them; rounding must not leave it a hair away.
  return {share, hits == 0 ? 0.0 : (middle - width) / scale, hits == runs ? 1.0 : (middle + width) / scale};
}

Estimate MedianOf(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::ranges::sort(sorted);
  const std::size_t n = sorted.size();
  const double middle = n % 2 == 1 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]);
  // How many values lie below the median is binomial with 1/2: the largest number of values that may be cut off at each
  // end while no more than 2.5 % of that distribution is lost there.
  double log_weight = -static_cast<double>(n) * std::log(2.0), below = 0.0;
  std::size_t cut = 0;
  for (std::size_t k = 0; k < n / 2; ++k) {
    below += std::exp(log_weight);
    if (below > 0.025) break;
    cut = k;
    log_weight += std::log(static_cast<double>(n - k)) - std::log(static_cast<double>(k + 1));
  }
  return {middle, sorted[cut], sorted[n - 1 - cut]};
}

bool TooWide(const Estimate& estimate, int values) {
  return values < kFewestForInterval || estimate.low < 0.7 * estimate.middle || estimate.high > 1.3 * estimate.middle;
}

}  // namespace lensd::bench
