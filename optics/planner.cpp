// From a request to its answer: check it, solve every case, keep the best, or find out why there is none.
#include "optics/planner.h"

#include <cmath>
#include <limits>
#include <set>

#include "planner_cases.h"
#include "planner_check.h"
#include "planner_conflict.h"
#include "planner_depth.h"
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

/// Whether a is the better plan.
bool Better(const PlanRequest& request, const Solved& a, const Solved& b) {
  constexpr double kSameN = 1e-13, kSameRatio = 1e-12, kSameDepth = 1e-12;
  const int n = Compare(a.n, b.n, kSameN), ratio = Compare(a.ratio, b.ratio, kSameRatio);
  if (request.objective == Objective::Depth) {
    const FieldDepth field_a = FieldDepthAt(request, a.n, a.e), field_b = FieldDepthAt(request, b.n, b.e);
    const int depth = Compare(field_b.near - field_b.far, field_a.near - field_a.far, kSameDepth);
    return depth != 0 ? depth < 0 : n < 0;
  }
  const int first = request.objective == Objective::Sharp ? ratio : n;
  const int second = request.objective == Objective::Sharp ? n : ratio;
  if (first != 0) return first < 0;
  return second != 0 ? second < 0 : a.e < b.e;
}

struct Outcome {
  std::optional<Solved> best;
  std::set<int> suspects;
  bool scanned = false;
};

Outcome SolveThese(const Cases& cases, const PlanRequest& request, const InForce& in_force) {
  Outcome outcome;
  cases.ForEach(in_force, [&](Task& task) {
    Solved solved = SolveForN(task, request.objective == Objective::Depth);
    outcome.scanned = outcome.scanned || solved.scanned;
    if (!solved.feasible) {
      outcome.suspects.insert(solved.names.begin(), solved.names.end());
      return true;
    }
    if (request.objective == Objective::Sharp) {
      if (const std::optional<Solved> sharpest = SolveForRatio(task)) solved = *sharpest;
    }
    if (request.objective == Objective::Depth && CountsDiffraction(task)) solved.n = DeepestN(task, solved.n, solved.e);
    if (!outcome.best || Better(request, solved, *outcome.best)) outcome.best = solved;
    return true;
  });
  return outcome;
}

Outcome SolveAll(const Cases& cases, const PlanRequest& request) {
  const InForce everything = Everything(request);
  if (const std::optional<InForce> given = cases.WithoutOpen(everything)) {
    Outcome outcome = SolveThese(cases, request, *given);
    if (!outcome.best) return outcome;
  }
  return SolveThese(cases, request, everything);
}

std::optional<double> Relax(const Cases& cases, const PlanRequest& request) {
  double relax = std::numeric_limits<double>::infinity();
  const auto visit = [&](Task& task) {
    const std::optional<Solved> solved = SolveForRatio(task);
    if (solved) relax = std::min(relax, solved->ratio);
    return true;
  };
  cases.ForEach(Everything(request), visit, relax);
  return std::isfinite(relax) ? std::optional(relax) : std::nullopt;
}

}  // namespace

Result<PlanAnswer> Plan(const PlanRequest& request) {
  if (std::optional<Error> error = Check(request)) return std::unexpected(*std::move(error));
  const Cases cases(request);
  const Outcome outcome = SolveAll(cases, request);
  PlanAnswer answer;
  if (outcome.scanned) {
    answer.note =
        "limits this large next to diffraction leave a set that is not convex: it was scanned over the f-number";
  }
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
  if (request.objective == Objective::Depth) {
    const FieldDepth field = FieldDepthAt(request, outcome.best->n, outcome.best->e);
    answer.depth_of_field = DepthInterval{PlanDepth::Vergence(field.near), PlanDepth::Vergence(field.far)};
  }
  return answer;
}

}  // namespace lensd::optics
