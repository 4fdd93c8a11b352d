// From a request to linear programmes: limits become lines, open sides become cases.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "optics/planner/limit_lines.h"

namespace lensd::optics {

/// Which names are in force: dropping one is how conflicts are found.
struct ActiveLimits {
  std::vector<char> limits;  ///< 1 in force, 0 not
  bool f_number = true;
  bool extension = true;
  bool focus = true;
  bool depth = true;  ///< the blur limit of Objective::Depth
};

ActiveLimits Everything(const PlanRequest& request);

/// An interval with its ends in order.
struct OrderedInterval {
  const PlanDepth* near = nullptr;
  const PlanDepth* far = nullptr;
};
OrderedInterval Ordered(const DepthInterval& interval);

inline constexpr double kHolds = 1.0;

/// A request reduced to the depths that matter. Points into the request, which must outlive it.
class SideAssignments {
 public:
  explicit SideAssignments(const PlanRequest& request);

  /// Calls `visit(task)` for every assignment of the open intervals to sides that any focal plane can make: it lies in
  /// one of the gaps between them, so that k intervals make at most k + 1 cases. Stops when `visit` returns false.
  /// SideAssignments that need a worst ratio above `most_ratio`, which `visit` may lower as it goes, may be passed
  /// over.
  void ForEach(const ActiveLimits& in_force, const std::function<bool(Subproblem&)>& visit,
               const double& most_ratio = kHolds) const;

  /// `in_force` without the limits whose side is open, which can make thousands of cases; nothing if it has none. What
  /// is infeasible without them is infeasible.
  std::optional<ActiveLimits> WithoutOpen(const ActiveLimits& in_force) const;

 private:
  struct OpenInterval {
    OrderedInterval ends;
    int limit;
  };
  /// Each stop in turn, or the range; false when the visitor has had enough.
  bool VisitStops(Subproblem& task, const std::function<bool(Subproblem&)>& visit) const;
  const Number& LimitOf(const OpenInterval& interval) const;
  double SmallestN() const;

  const PlanRequest& request_;
  std::vector<LimitRow> rows_;        ///< of limits whose sides are given
  std::vector<OpenInterval> open_;    ///< nearest first
  std::vector<const Number*> stops_;  ///< ascending f-numbers
};

}  // namespace lensd::optics
