// What a lens contributes to a plan: its positions as it stands now. All of it is a copy of one moment, so that a plan
// can be solved on any thread, whatever the rig does meanwhile.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "optics/lens_positions.h"
#include "planning/motor_positions.h"
#include "proto/plan_json.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// The targets of an axis: a grid within soft limits.
struct AxisGrid {
  Native origin;
  double resolution = 1.0;  ///< > 0
  Native low, high;
};

/// What planning has to know of a lens.
struct PlannedLens {
  std::shared_ptr<const rig::OpticsTable> optics;  ///< under the conditions of one moment; never null
  drivers::PerAxis<std::optional<AxisGrid>> axes;
  std::optional<Metres> pixel;
  std::optional<Metres> sensor_width;
};

/// A lens under the conditions of one moment: zoom, filter, temperature.
struct Planning {
  PlannedLens lens;
  optics::PlanRequest defaults;  ///< what a request leaves out; tolerances: half a step, for people to read
  optics::FocusScale scale;      ///< where configured distances start, the lens centre being where it is now
  /// Bounds hold what calibration and temperature leave open; where the motors stand is added for each plan.
  optics::LensPositions positions;
  std::vector<Native> focus;  ///< of the positions; empty: there is no such motor
  std::vector<Native> iris;
  std::optional<Native> zoom;  ///< where it shall go; nothing: it stays
  MotorPositionsCache motors;  ///< the positions with that added
};

/// Configured distances with the lens centre where it stands under the conditions of `optics`.
optics::FocusScale ScaleUnder(const rig::OpticsTable& optics, const rig::RigConfig& config);

/// Nothing where the optics are not known. On the rig's thread.
std::optional<Planning> PlanningOf(const rig::Rig& rig, const rig::RigConfig& config);

/// Half a step of its positions, and what calibration leaves open of them, as the defaults of their tolerances.
void StateTolerances(Planning& planning);

/// The lens under its conditions.
Planning PlanningUnder(PlannedLens lens, const rig::RigConfig& config);

/// A plan on the positions of a lens.
struct LensPlan {
  optics::PositionPlan answer;
  std::optional<Native> focus;  ///< where to move; none: that motor does not exist
  std::optional<Native> iris;
  std::optional<Native> zoom;         ///< none: it stays
  std::optional<Metres> field_width;  ///< at the distance of the request's field
};

/// Solves the request on the lens' positions, each within the bound that a motion from `now` ends with. Errors as
/// optics::Plan.
Result<LensPlan> PlanFor(const Planning& planning, const proto::LensRequest& asked, const rig::Status& now);

/// The shots of a stack, on the same terms. Errors as optics::PlanStack.
struct LensStack {
  optics::PositionStack answer;
  std::vector<optics::FocusPosition> shots;
  std::vector<Native> focus;           ///< one a shot, or none
  std::optional<Native> iris;          ///< of all of them
  std::vector<Metres> field_widths{};  ///< one a shot, at the distance of the request's field; or none
};
Result<LensStack> StackFor(const Planning& planning, const proto::LensRequest& asked, const rig::Status& now);

/// How the limits fare where the lens stands, from what is measured of it alone; nothing where that is not known.
std::optional<optics::PlanAnswer> CheckNow(const rig::Status& now, const rig::RigConfig& config,
                                           const proto::LensRequest& asked);

}  // namespace lensd::daemon
