// Changing the focal length without losing the focal plane.
#pragma once

#include <optional>
#include <string>

#include "rig/rig.h"

namespace lensd::rig {

struct ZoomRequest {
  Target target;  ///< of the zoom axis
  /// How far focus may be off on the way, metres on the sensor side; nothing: two pixels of blur at the f-number in
  /// force where that is known, else a hundredth of the focus range. Smaller bounds make more, shorter steps.
  std::optional<Metres> tolerance;
};

struct ZoomOutcome {
  MoveOutcome zoom;
  std::optional<MoveOutcome> focus;  ///< its last move; nothing where the zoom never left its place
  /// All the way the sensor stood within this of where the plane kept in focus is sharp, as far as calibration and
  /// readings can tell.
  Metres tracking_bound;
  Dioptres kept;  ///< vergence of the plane that was kept
  int steps = 0;  ///< parts the way was divided into
};

/// Moves the zoom step by step and focus with it, so that what is in focus now stays so; focus ends approached from
/// its own side. Ends where focus cannot follow, saying how far it came (zoom.reached is false). Unsupported: focal
/// lengths or focus not known. OutOfRange: the plane cannot be in focus at the end of the way. Superseded, Cancelled:
/// another caller commanded the lens. On the rig's thread, as Rig::Move().
void ZoomKeepingFocus(Rig& rig, const ZoomRequest& request, std::move_only_function<void(Result<ZoomOutcome>)> done);

}  // namespace lensd::rig
