// What a lens contributes to a plan.
#pragma once

#include <optional>

#include "optics/planner.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// Constant for the life of a lens.
struct Planning {
  optics::PlanRequest defaults;  ///< what a request leaves out
  Metres principal_gap{0.0};
  bool has_focus = false;
  bool has_iris = false;
};

/// Nothing where the optics are not known. The tolerances are half a step of each motor: a plan that keeps them holds
/// wherever rounding to a step puts the lens.
std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config);

}  // namespace lensd::daemon
