#include "planner_columns_exact.h"

#include "optics/planner.h"
#include "planner_solve.h"

namespace lensd::optics {

namespace {

/// A task that owns the request and the depths it points at.
struct Owned {
  PlanRequest request;
  std::vector<PlanDepth> depths;
  std::vector<Number> limits;
  Task task;

  void Add(RowKind kind, double vergence, double limit) {
    depths.push_back(PlanDepth::Vergence(vergence));
    limits.emplace_back(limit);
    task.rows.push_back({kind, &depths.back(), &limits.back(), 0});
  }
};

}  // namespace

ColumnPlan PlanColumnsExactly(const ColumnLens& lens, const LimitColumns& limits) {
  Owned owned;
  owned.request.focal_length = lens.focal_length;
  owned.request.f_numbers = {lens.n_low, lens.n_high};
  owned.request.extensions = {lens.e_low, lens.e_high};
  owned.request.sensor_tolerance = lens.sensor_tolerance;
  owned.request.f_number_tolerance = lens.f_number_tolerance;
  owned.task.request = &owned.request;
  const std::size_t rows = 2 * limits.sharp_limit.size() + limits.behind_limit.size() + limits.front_limit.size();
  owned.depths.reserve(rows);
  owned.limits.reserve(rows);
  for (std::size_t i = 0; i < limits.sharp_limit.size(); ++i) {
    owned.Add(RowKind::SharpFar, limits.sharp_far[i], limits.sharp_limit[i]);
    owned.Add(RowKind::SharpNear, limits.sharp_near[i], limits.sharp_limit[i]);
  }
  for (std::size_t i = 0; i < limits.behind_limit.size(); ++i) {
    owned.Add(RowKind::Behind, limits.behind_near[i], limits.behind_limit[i]);
  }
  for (std::size_t i = 0; i < limits.front_limit.size(); ++i) {
    owned.Add(RowKind::Front, limits.front_far[i], limits.front_limit[i]);
  }
  const Solved solved = SolveForNExactly(owned.task, false);
  return {solved.feasible, solved.n, solved.e, solved.ratio};
}

}  // namespace lensd::optics
