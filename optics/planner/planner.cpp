// From a request to its answer: check it, solve every case, keep the best, or find out why there is none. README.md
// beside it tells the idea and where to read on.
#include "optics/planner.h"

#include <cmath>
#include <limits>
#include <set>

#include "optics/model_ladder.h"
#include "optics/planner/deepest_field.h"
#include "optics/planner/minimal_conflict.h"
#include "optics/planner/plain_limits.h"
#include "optics/planner/report.h"
#include "optics/planner/request_check.h"
#include "optics/planner/side_assignments.h"
#include "optics/planner/solve.h"
#include "optics/planner/solve_diffracted.h"
#include "optics/planner/solve_linear.h"

namespace lensd::optics {

namespace {

/// a before b by more than rounding: -1, 1; 0 when they tie.
int Compare(double a, double b, double relative) {
  if (std::abs(a - b) <= relative * std::max(std::abs(a), std::abs(b))) return 0;
  return a < b ? -1 : 1;
}

/// Whether a is the better plan.
bool Better(const PlanRequest& request, const Solution& a, const Solution& b) {
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
  std::optional<Solution> best;
  std::set<int> suspects;
  bool scanned = false;
  bool undecided = false;
};

Outcome SolveThese(const SideAssignments& cases, const PlanRequest& request, const ActiveLimits& in_force) {
  Outcome outcome;
  cases.ForEach(in_force, [&](Subproblem& task) {
    Solution solved = SolveForN(task, request.objective == Objective::Depth ? WantedN::Largest : WantedN::Smallest);
    outcome.scanned = outcome.scanned || solved.scanned;
    outcome.undecided = outcome.undecided || solved.undecided;
    if (!solved.feasible) {
      outcome.suspects.insert(solved.names.begin(), solved.names.end());
      return true;
    }
    if (request.objective == Objective::Sharp) {
      if (const std::optional<Solution> sharpest = SolveForRatio(task)) solved = *sharpest;
    }
    if (request.objective == Objective::Depth && CountsDiffraction(task)) solved.n = DeepestN(task, solved.n, solved.e);
    if (!outcome.best || Better(request, solved, *outcome.best)) outcome.best = solved;
    return true;
  });
  return outcome;
}

Outcome SolveAll(const SideAssignments& cases, const PlanRequest& request) {
  const ActiveLimits everything = Everything(request);
  if (const std::optional<ActiveLimits> given = cases.WithoutOpen(everything)) {
    Outcome outcome = SolveThese(cases, request, *given);
    if (!outcome.best) return outcome;
  }
  return SolveThese(cases, request, everything);
}

/// The least worst ratio of all cases. A class of a depth map makes tens of thousands of them, and a certain ratio may
/// need exact arithmetic: so the most promising one is solved for certain first, and of the others those that need more
/// by a proof in double precision (a hair more than `kHair`, which is all the answer may be off) are passed over.
std::optional<Solution> Relax(const SideAssignments& cases, const PlanRequest& request) {
  constexpr double kHair = 1e-10;
  const ActiveLimits everything = Everything(request);
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double relax = kNone;
  std::size_t count = 0, promising = 0;
  cases.ForEach(
      everything,
      [&](Subproblem& task) {
        const std::optional<double> about = RoughRatio(task);
        if (about && *about < relax) relax = *about, promising = count;
        ++count;
        return true;
      },
      std::numeric_limits<double>::max());
  relax = kNone;
  std::optional<Solution> best;
  const auto solve = [&](Subproblem& task) {
    std::optional<Solution> solved = SolveForRatio(task);
    if (!solved || !(solved->ratio < relax)) return;
    relax = solved->ratio;
    best = std::move(solved);
  };
  std::size_t at = 0;
  const auto visit_promising = [&](Subproblem& task) {
    if (at++ != promising) return true;
    solve(task);
    return false;
  };
  cases.ForEach(everything, visit_promising, std::numeric_limits<double>::max());
  if (count == 1) return best;
  const auto visit_others = [&](Subproblem& task) {
    if (!CertainlyNeedsMore(task, relax * (1.0 - kHair))) solve(task);
    return true;
  };
  cases.ForEach(everything, visit_others, relax);
  return best;
}

/// `cases`: left empty where the answer is plain.
Result<Outcome> OutcomeOf(const PlanRequest& request, std::optional<SideAssignments>& cases) {
  if (std::optional<Error> error = CheckSetting(request)) return PassOn(*std::move(error));
  if (Attempt<Solution> plain = SolvePlainLimits(request); plain.certain && plain.answer.feasible) {
    Outcome outcome;
    outcome.best = std::move(plain.answer);
    return outcome;
  }
  if (std::optional<Error> error = CheckLimits(request)) return PassOn(*std::move(error));
  return SolveAll(cases.emplace(request), request);
}

}  // namespace

std::optional<PlanAnswer> PlanIfAny(const PlanRequest& request) {
  std::optional<SideAssignments> cases;
  const auto outcome = OutcomeOf(request, cases);
  if (!outcome || !outcome->best) return std::nullopt;
  PlanAnswer answer;
  answer.feasible = true;
  Describe(request, outcome->best->n, outcome->best->e, answer);
  return answer;
}

Result<PlanAnswer> Plan(const PlanRequest& request) {
  std::optional<SideAssignments> cases;
  auto solved = OutcomeOf(request, cases);
  if (!solved) return PassOn(solved);
  const Outcome& outcome = *solved;
  PlanAnswer answer;
  if (outcome.scanned) {
    answer.note =
        "with limits this large compared with diffraction the feasible set is not convex: it was searched by branch "
        "and bound over the f-number";
    if (outcome.undecided) {
      answer.note += ", which ended undecided: change a limit slightly";
    }
  }
  if (!outcome.best) {
    answer.conflict = Spelled(request, MinimalConflict(*cases, request, outcome.suspects));
    if (const std::optional<Solution> relaxed = Relax(*cases, request)) {
      answer.relax = relaxed->ratio;
      Describe(request, relaxed->n, relaxed->e, answer);
    }
    return answer;
  }
  answer.feasible = true;
  Describe(request, outcome.best->n, outcome.best->e, answer);
  const ChosenModel model = ModelFor(request, answer.limits);
  answer.model = RungName(model.rung);
  answer.model_error = model.error;
  if (request.objective == Objective::Depth) {
    const FieldDepth field = FieldDepthAt(request, outcome.best->n, outcome.best->e);
    answer.depth_of_field = DepthInterval{PlanDepth::Vergence(field.near), PlanDepth::Vergence(field.far)};
  }
  return answer;
}

}  // namespace lensd::optics
