// Times methods side by side.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/plan/peers.h"

namespace lensd::bench {

/// One method on one set of problems.
struct Measured {
  std::string set;
  std::string method;
  std::size_t limits = 0;  ///< of the largest problem
  std::size_t problems = 0;
  double time_us = 0;  ///< median over the rounds of the time for one plan
  /// Median over the rounds of time/(lensd's time in that round); nothing where none of ours ran.
  std::optional<double> time_to_ours = std::nullopt;
  bool plans = true;     ///< else it only reads the data
  double error_max = 0;  ///< of the f-number, relative; over the problems that were answered
  double error_p50 = 0;
  std::size_t wrong =
      0;  ///< called impossible, or breaking a limit by more than 1e-9 of it, or answered though impossible
  std::size_t refused = 0;  ///< of these, called impossible
  std::size_t over = 0;     ///< meeting every limit with an f-number more than 1e-9 too large
};

/// The middle value, of an even count the upper one of two; of nothing 0.
double Median(std::vector<double> values);

/// Times every method on the set in `rounds` rounds, one method after the other within a round, so that what slows the
/// machine slows all of them.
std::vector<Measured> Measure(const ProblemSet& set, const std::vector<Method>& methods, int rounds);

/// A plan that keeps one class of a depth map of `pixels` sharp, as lensctl makes it of map and mask, beside reading
/// both once.
std::vector<Measured> MeasureDepthMap(std::size_t pixels, std::uint64_t seed, int rounds);

}  // namespace lensd::bench
