// Times planning methods in turns on the same problems and judges each answer against the reference.
#include "bench/plan/measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;

double Microseconds(Clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

/// One method made ready for a set.
struct Runner {
  std::string name;
  std::vector<Solver> solvers;
  bool ours = false;
  bool plans = true;  ///< else it only reads the data
  int repeats = 1;
  bool slow = false;                 ///< three rounds are enough of it
  std::vector<double> time_us = {};  ///< of each round
};

double RunOnce(const Runner& runner) {
  const auto start = Clock::now();
  for (int i = 0; i < runner.repeats; ++i) {
    for (const Solver& solve : runner.solvers) solve();
  }
  const double time = Microseconds(Clock::now() - start);
  return time / runner.repeats / static_cast<double>(runner.solvers.size());
}

/// Enough repeats for a round of about 20 ms.
void Calibrate(Runner& runner) {
  constexpr double kRoundUs = 20e3;
  const double once = RunOnce(runner) * static_cast<double>(runner.solvers.size());
  runner.slow = once > 10 * kRoundUs;
  runner.repeats = std::clamp(static_cast<int>(kRoundUs / std::max(once, 1e-3)), 1, 100000);
}

std::size_t MostLimits(const ProblemSet& set) {
  std::size_t most = 0;
  for (const Problem& problem : set.problems) most = std::max(most, problem.limits.size());
  return most;
}

std::vector<Runner> Prepare(const ProblemSet& set, const std::vector<Method>& methods) {
  const std::size_t largest = MostLimits(set);
  std::vector<Runner> runners;
  for (const Method& method : methods) {
    if (!method.missing.empty() || largest > method.most_limits) continue;
    Runner runner{.name = method.name, .solvers = {}, .ours = method.ours, .plans = method.plans};
    for (const Problem& problem : set.problems) runner.solvers.push_back(method.prepare(problem));
    Calibrate(runner);
    runners.push_back(std::move(runner));
  }
  return runners;
}

void Judge(const ProblemSet& set, const std::vector<double>& truth, const Runner& runner, Measured& measured) {
  constexpr double kSlack = 1e-9;
  std::vector<double> errors;
  for (std::size_t i = 0; i < set.problems.size(); ++i) {
    const Answer answer = runner.solvers[i]();
    if (std::isnan(truth[i])) {
      if (std::isfinite(answer.n)) ++measured.wrong;
      continue;
    }
    if (!std::isfinite(answer.n)) ++measured.refused;
    const bool holds = Violation(set.problems[i], answer) <= kSlack;
    const double error = std::abs(answer.n - truth[i]) / truth[i];
    if (!holds) ++measured.wrong;
    if (holds && error > kSlack) ++measured.over;
    if (std::isfinite(error)) errors.push_back(error);
  }
  measured.error_p50 = Median(errors);
  if (!errors.empty()) measured.error_max = *std::max_element(errors.begin(), errors.end());
}

}  // namespace

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<Measured> Measure(const ProblemSet& set, const std::vector<Method>& methods, int rounds) {
  std::vector<Runner> runners = Prepare(set, methods);
  std::vector<double> fastest_of_ours;
  for (int round = 0; round < rounds; ++round) {
    double fastest = std::numeric_limits<double>::infinity();
    for (Runner& runner : runners) {
      if (runner.slow && round >= 3) continue;
      runner.time_us.push_back(RunOnce(runner));
      if (runner.ours) fastest = std::min(fastest, runner.time_us.back());
    }
    fastest_of_ours.push_back(fastest);
  }
  std::vector<double> truth;
  for (const Problem& problem : set.problems) truth.push_back(TrueFNumber(problem));
  std::vector<Measured> rows;
  for (const Runner& runner : runners) {
    Measured row{.set = set.name, .method = runner.name, .limits = MostLimits(set), .problems = set.problems.size()};
    row.time_us = Median(runner.time_us);
    std::vector<double> ratios;
    for (std::size_t i = 0; i < runner.time_us.size(); ++i) ratios.push_back(runner.time_us[i] / fastest_of_ours[i]);
    if (std::isfinite(fastest_of_ours.front())) row.time_to_ours = Median(ratios);
    row.plans = runner.plans;
    if (runner.plans) Judge(set, truth, runner, row);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace lensd::bench
