#include "bench/plan/measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;

double Microseconds(Clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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

/// Reads every double of the problem once: nothing that looks at all of it can be faster.
Solver ReadOnce(const Problem& problem) {
  return [&problem]() -> Answer {
    double sums[8] = {};
    for (const auto* data : {&problem.sample_vergence, &problem.sample_limit}) {
      const std::size_t whole = data->size() / 8 * 8;
      for (std::size_t i = 0; i < whole; i += 8) {
        for (std::size_t k = 0; k < 8; ++k) sums[k] += (*data)[i + k];
      }
    }
    return {std::accumulate(std::begin(sums), std::end(sums), 0.0), 0};
  };
}

std::vector<Runner> Prepare(const ProblemSet& set, std::vector<Method> methods) {
  std::size_t largest = 0;
  for (const Problem& problem : set.problems) largest = std::max(largest, Size(problem));
  const std::size_t plans = methods.size();
  if (!set.problems.front().sample_vergence.empty()) methods.push_back({"reading the data once", ReadOnce, largest});
  std::vector<Runner> runners;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const Method& method = methods[i];
    if (!method.missing.empty() || largest > method.most_limits) continue;
    Runner runner{.name = method.name, .solvers = {}, .ours = method.ours, .plans = i < plans};
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
  std::size_t largest = 0;
  for (const Problem& problem : set.problems) {
    truth.push_back(TrueFNumber(problem));
    largest = std::max(largest, Size(problem));
  }
  std::vector<Measured> rows;
  for (const Runner& runner : runners) {
    Measured row{.set = set.name, .method = runner.name, .limits = largest, .problems = set.problems.size()};
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
