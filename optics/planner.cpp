// From a request to its answer: check it, solve every case, keep the best, or find out why there is none.
#include "optics/planner.h"

#include <cmath>
#include <set>

#include "planner_cases.h"
#include "planner_check.h"
#include "planner_conflict.h"
#include "planner_model.h"
#include "planner_report.h"
#include "planner_solve.h"

namespace lensd::optics {

namespace {

/// a before b by more than rounding: -1, 1; 0 when they tie.
int Compare(double a, double b, double relative) {
  if (std::abs(a - b) <= relative * std::max(std::abs(a), std::abs(b))) return 0;
  return a < b ? -1 : 1;
}

bool Better(Objective objective, const Solved& a, const Solved& b) {
  constexpr double kSameN = 1e-13, kSameRatio = 1e-12;
  const int n = Compare(a.n, b.n, kSameN), ratio = Compare(a.ratio, b.ratio, kSameRatio);
  const int first = objective == Objective::Sharp ? ratio : objective == Objective::Light ? n : -n;
  const int second = objective == Objective::Sharp ? n : ratio;
  if (first != 0) return first < 0;
  return second != 0 ? second < 0 : a.e < b.e;
}

struct Outcome {
  std::optional<Solved> best;
  std::set<int> suspects;
};

Outcome SolveAll(const Cases& cases, const PlanRequest& request) {
  Outcome outcome;
  cases.ForEach(Everything(request), [&](Task& task) {
    Solved solved = SolveForN(task, request.objective == Objective::Depth);
    if (!solved.feasible) {
      outcome.suspects.insert(solved.names.begin(), solved.names.end());
      return true;
    }
    if (request.objective == Objective::Sharp) {
      if (const std::optional<Solved> sharpest = SolveForRatio(task)) solved = *sharpest;
    }
    if (!outcome.best || Better(request.objective, solved, *outcome.best)) outcome.best = solved;
    return true;
  });
  return outcome;
}

std::optional<double> Relax(const Cases& cases, const PlanRequest& request) {
  std::optional<double> relax;
  cases.ForEach(Everything(request), [&](Task& task) {
    const std::optional<Solved> solved = SolveForRatio(task);
    if (solved && (!relax || solved->ratio < *relax)) relax = solved->ratio;
    return true;
  });
  return relax;
}

/// Where blur reaches the limit on both sides of the focal plane, at every extension within the tolerance.
DepthInterval DepthOfField(const PlanRequest& request, double n, double e) {
  const double f = request.focal_length.value, delta = request.sensor_tolerance.value;
  const double skew = f * (1.0 / request.pupil_factor.value - 1.0);
  const double reach = request.depth_limit->value * (1.0 - request.f_number_tolerance.value) * n;
  const double near = (e - delta + reach) / (f * (f + e - delta) - reach * skew);
  const double far = (e + delta - reach) / (f * (f + e + delta) + reach * skew);
  return {PlanDepth::Vergence(near), PlanDepth::Vergence(std::max(far, 0.0))};
}

}  // namespace

Result<PlanAnswer> Plan(const PlanRequest& request) {
  if (std::optional<Error> error = Check(request)) return std::unexpected(*std::move(error));
  const Cases cases(request);
  const Outcome outcome = SolveAll(cases, request);
  PlanAnswer answer;
  if (!outcome.best) {
    answer.conflict = Spelled(request, MinimalConflict(cases, request, outcome.suspects));
    answer.relax = Relax(cases, request);
    return answer;
  }
  answer.feasible = true;
  Describe(request, outcome.best->n, outcome.best->e, answer);
  const ChosenModel model = ModelFor(request);
  answer.model = RungName(model.rung);
  answer.model_error = model.error;
  if (request.objective == Objective::Depth)
    answer.depth_of_field = DepthOfField(request, outcome.best->n, outcome.best->e);
  return answer;
}

}  // namespace lensd::optics
