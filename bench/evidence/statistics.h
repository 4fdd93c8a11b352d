// Intervals for what was counted and what was timed.
#pragma once

#include <span>

namespace lensd::bench {

/// A figure and its 95 % interval.
struct Estimate {
  double middle = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// A share with its Wilson score interval. `runs` > 0.
Estimate ShareOf(int hits, int runs);

/// The median with the interval between two order statistics that holds the true median in at least 95 % of all
/// samples. With fewer than 6 values there is no such interval: the ends are then the least and the greatest value. Not
/// empty; infinite values count as the greatest.
Estimate MedianOf(std::span<const double> values);

/// Fewer values than this have no 95 % interval of their median.
inline constexpr int kFewestForInterval = 6;

/// A timing that says little: no 95 % interval, or one that reaches beyond 0.7 or 1.3 times the median.
bool TooWide(const Estimate& estimate, int values);

}  // namespace lensd::bench
