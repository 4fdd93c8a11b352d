// Brightness kept while the aperture changes: the exposure time follows the square of the working f-number.
#pragma once

#include "base/clock.h"
#include "base/units.h"
#include "drivers/api/camera.h"
#include "rig/rig.h"

namespace lensd::rig {

/// An exposure time for another f-number.
struct KeptExposure {
  Duration wanted{};    ///< what would give the same brightness
  Duration exposure{};  ///< what the camera takes
  double ratio = 1.0;   ///< brightness with `exposure` over that before
};

/// The light on the sensor goes with exposure time over the square of the working f-number N (1 + m/p). Cut to what
/// the camera takes where it says so, and to what leaves its frame rate alone. f-numbers and `before` > 0.
KeptExposure ExposureFor(Duration before, FNumber working_before, FNumber working_after,
                         const drivers::CameraCapabilities& camera);

/// A move of the iris, and what became of the exposure.
struct BrightMove {
  MoveOutcome move;
  std::optional<KeptExposure> exposure;  ///< nothing: it was left alone, because of `reason`
  std::string reason;                    ///< empty, or what keeps the brightness from being the same
};

/// FrameRequests once, moves the iris and sets the exposure that keeps the picture's brightness. Unsupported: no
/// camera, an exposure that cannot be set, f-numbers that are not known. Otherwise as Rig::Move() and Rig::Snapshot().
/// `pupil_factor` is exit over entrance pupil. On the rig's thread, as Rig::Move().
void MoveIrisKeepingBrightness(Rig& rig, const Target& target, double pupil_factor,
                               std::move_only_function<void(Result<BrightMove>)> done);

}  // namespace lensd::rig
