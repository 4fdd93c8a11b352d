// Plans on the positions a lens can take, each as the lens truly stands there: no equivalent lens stands in between.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "optics/focus_blocks.h"
#include "optics/planner.h"
#include "optics/stack.h"

namespace lensd::optics {

/// A lens with its focus motor at one position.
struct FocusPosition {
  Metres focal_length;     ///< there: zoom and breathing counted
  Metres extension;        ///< beyond that focal length
  Metres sensor_distance;  ///< lens centre to sensor
  Dioptres focal_plane;
  Dioptres bound;  ///< the true plane in focus is within this of it
};

/// A lens with its iris motor at one position.
struct IrisPosition {
  FNumber f_number;
  FNumber lowest;  ///< the true f-number lies between these
  FNumber highest;
};

/// What a lens can do without zooming. The opening is `focal_length` over the f-number wherever it is focused.
struct LensPositions {
  Metres focal_length;               ///< at extension 0
  double focal_length_error = 0.0;   ///< relative; what it does to the plane in focus is in the bounds already
  bool liquid = false;               ///< the power changes and the sensor stays
  std::vector<FocusPosition> focus;  ///< at least one, focal planes rising
  std::vector<IrisPosition> iris;    ///< at least one, f-numbers rising
};

/// Where the distances of a request start: so far from the lens centre toward the sensor. Vergences start at the
/// centre.
struct DistanceOrigin {
  bool at_sensor = false;  ///< the sensor distance comes on top
  Metres behind{0.0};
  Metres At(const FocusPosition& position) const { return at_sensor ? behind + position.sensor_distance : behind; }
};

/// A plan on positions, as Plan() gives it. Where some setting would do but no position does, `plan` is infeasible
/// without a conflict and describes the position that comes closest.
struct PositionPlan {
  PlanAnswer plan;
  bool continuous_feasible = false;  ///< some setting, not only positions, would do
  std::size_t focus = 0;             ///< of LensPositions
  std::size_t iris = 0;
  /// The question as Plan() takes it: a lens that is everywhere what this one is at the position chosen, whose
  /// f-numbers are those of its focal length there.
  PlanRequest request;
};

/// The question as Plan() takes it, for a lens that is everywhere what this one is at its first positions. A request
/// that Plan() would refuse stays one.
PlanRequest RequestAtFirst(const PlanRequest& request, const LensPositions& lens, const DistanceOrigin& origin = {});

/// Solves `request`, whose focal length does not count, over every pair of positions; tolerances are at least those of
/// the positions. Ranges that hold no position, and each stop and a fixed focus, mean the position nearest to them.
/// Limits hold to a part in 1e12. `blocks` are those of the positions, made once for many requests. Errors as Plan().
Result<PositionPlan> PlanOnPositions(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                                     const DistanceOrigin& origin = {});

/// The plan of PlanOnPositions() where there is one, of which the setting alone is told: nothing of its limits. It
/// takes less time than to say why there is none.
std::optional<PositionPlan> PlanOnPositionsIfAny(const PlanRequest& request, const LensPositions& lens,
                                                 const FocusBlocks& blocks, const DistanceOrigin& origin = {});

/// How the limits fare at the first position of focus and iris; feasible where all of them hold. Errors as Plan().
Result<PlanAnswer> CheckPosition(const PlanRequest& request, const LensPositions& lens,
                                 const DistanceOrigin& origin = {});

/// A focus stack on positions.
struct PositionStack {
  StackAnswer stack;
  std::vector<std::size_t> focus;  ///< of LensPositions, one a shot
  std::size_t iris = 0;
};

/// The fewest shots that keep every sharp limit, at the smallest f-number that allows so few. `blocks` as for
/// PlanOnPositions(). Errors as PlanStack().
Result<PositionStack> StackOnPositions(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                                       const DistanceOrigin& origin = {});

}  // namespace lensd::optics
