// What a lens contributes to a plan.
#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "optics/planner.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// The positions one motor can take, and what they mean. Both in the same order.
struct Positions {
  std::vector<Native> native;
  optics::ReachableValues values;  ///< metres of extension, or f-numbers
};

/// Constant for the life of a lens.
struct Planning {
  optics::PlanRequest defaults;  ///< what a request leaves out; tolerances: what the motors keep, half a step
  Metres principal_gap{0.0};
  Positions focus;  ///< one value and no native position where it does not move
  Positions iris;
};

/// Under the conditions of this moment: zoom, temperature. Nothing where the optics are not known. The tolerances hold
/// the calibration's error and that of the focal length as well.
std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config);

/// The extension that focuses on the same plane with the focal length the planner is told, which knows no breathing.
Metres PlanExtension(const rig::OpticsTable& optics, Metres extension);
/// How far that may be from the true one where a motion has ended; nothing where it ended without optics.
std::optional<Metres> PlanBound(const rig::OpticsTable& optics, const rig::MoveOutcome& outcome);

/// A plan on the positions of a lens.
struct LensPlan {
  optics::GridAnswer answer;
  std::optional<Native> focus;  ///< where to move; none: that motor does not exist
  std::optional<Native> iris;
};

/// Solves the request on the lens' positions. Tolerances below what the motors keep are raised to it. Errors as
/// optics::Plan.
Result<LensPlan> PlanFor(const Planning& planning, optics::PlanRequest request);

/// How the request fares where the lens stands: `bound` is how far the true extension may be from the one stated.
Result<optics::PlanAnswer> PlanAt(const Planning& planning, optics::PlanRequest request, Metres extension, Metres bound,
                                  FNumber f_number);

}  // namespace lensd::daemon
