// The positions of a lens, each within the bound that a motion from where its motors stand now ends with.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "optics/lens_positions.h"
#include "rig/rig.h"

namespace lensd::daemon {

struct Planning;

struct MotorPositions {
  optics::LensPositions lens;
  optics::FocusBlocks blocks;  ///< of its focus
};

/// What the positions depend on beside the planning: of equal ones they are equal.
struct MotorsNow {
  double zoom_error = 0.0;  ///< relative, of the focal length
  std::optional<rig::Arrival> focus, iris;
  bool operator==(const MotorsNow&) const = default;
};

/// The last positions of one planning. They take longer to work out than most plans, and hold for as long as the motors
/// stand, or longer where nothing depends on that. Any thread may ask. A copy of it knows nothing yet.
class MotorPositionsCache {
 public:
  MotorPositionsCache() = default;
  MotorPositionsCache(const MotorPositionsCache&) {}
  MotorPositionsCache& operator=(const MotorPositionsCache&) {  // NOLINT(bugprone-unhandled-self-assignment): as above
    last_ = nullptr;
    return *this;
  }
  ~MotorPositionsCache() = default;

  std::shared_ptr<const MotorPositions> Of(const Planning& planning, const rig::Status& now) const;

 private:
  struct Worked {
    MotorsNow from;
    MotorPositions positions;
  };
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const Worked> last_;
};

/// The positions as MotorPositionsCache has them, worked out anew.
MotorPositions MotorPositionsOf(const Planning& planning, const rig::Status& now);

/// Relative: how far the focal length may be off with the zoom where it stands.
double ZoomErrorNow(const rig::OpticsTable& optics, const rig::Status& now);
/// What a focal length that may be off by a ratio does to the plane in focus.
Dioptres ZoomShift(const optics::FocusPosition& position, double error);
/// The f-numbers an iris within `bound` of a place may have.
optics::IrisPosition OpenAt(const rig::OpticsTable& optics, Native native, Native bound);

}  // namespace lensd::daemon
