// Where a lens was brought away from: what Undo goes back to.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "drivers/api/lens.h"
#include "rig/presets.h"

namespace lensd::daemon {

/// The last places where a lens stood when a command came. Commands that moved nothing leave no trace: a place is noted
/// once, however often it is left alone, and one that no command has left gives way to the next. Any thread.
class StateHistory {
 public:
  /// Before a command: where the lens stands, if it does and that is known.
  void Note(const rig::Rig& rig);
  /// What moves the lens next is no client's command: the place where it stands was left by none.
  void Disown(const rig::Rig& rig);
  /// Where somebody has said where an axis stands: positions from before mean other places now.
  void Clear();
  /// What to go back to from here; nothing: it was brought nowhere.
  std::optional<rig::Preset> Before(const rig::Rig& rig) const;

 private:
  struct Place {
    rig::Preset state;
    drivers::PerAxis<std::optional<Native>> sent;   ///< where lensd told an axis to go; nothing: it did not
    drivers::PerAxis<std::optional<Native>> slack;  ///< by this a reading may differ with nothing having moved
    std::uint64_t given = 0;                        ///< commands, when the place was noted
  };
  static constexpr std::size_t kMostPlaces = 8;
  static std::optional<Place> PlaceOf(const rig::Rig& rig);
  static bool Same(const Place& one, const Place& other);

  mutable std::mutex mutex_;
  std::deque<Place> places_;  ///< the newest last
};

}  // namespace lensd::daemon
