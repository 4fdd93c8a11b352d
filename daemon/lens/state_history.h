// Where a lens was brought away from: what Undo goes back to.
#pragma once

#include <mutex>
#include <optional>

#include "drivers/api/lens.h"
#include "rig/presets.h"

namespace lensd::daemon {

/// The last two places where a lens stood when a command came. Those that moved nothing leave no trace: a place is
/// noted once, however often it is left alone. Any thread.
class StateHistory {
 public:
  /// Before a command: where the lens stands, if it does and that is known.
  void Note(const rig::Rig& rig);
  /// What to go back to from here; nothing: it was brought nowhere.
  std::optional<rig::Preset> Before(const rig::Rig& rig) const;

 private:
  struct Place {
    rig::Preset state;
    drivers::PerAxis<std::optional<Native>> sent;   ///< where lensd told an axis to go; nothing: it did not
    drivers::PerAxis<std::optional<Native>> slack;  ///< by this a reading may differ with nothing having moved
  };
  static std::optional<Place> PlaceOf(const rig::Rig& rig);
  static bool Same(const Place& one, const Place& other);

  mutable std::mutex mutex_;
  std::optional<Place> last_;
  std::optional<Place> before_last_;
};

}  // namespace lensd::daemon
