// What is remembered of positions while no daemon runs: after a crash a position is known exactly when it should
// be.
#pragma once

#include <optional>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/lens.h"

namespace lensd::rig {

/// One axis as it was last known.
struct AxisMemory {
  Native position;         ///< where it came to rest; in motion: where that began
  bool in_motion = false;  ///< the motor may have turned since
  Native lowest;           ///< in motion: the ends of what it may have swept
  Native highest;
  bool known = true;    ///< the position referred to a reference
  double slack = 0.0;   ///< native units of backlash not taken up
  double travel = 0.0;  ///< native units travelled since the reference was searched
  double doubt = 0.0;   ///< native units: how far off the position may be besides
  Native offset{};      ///< what was added to the device's own count to get the position
  bool said = false;    ///< somebody has said where it stands, and it has not lost count since
};

/// A write that failed: what is on disk is older than the truth.
struct Unkept {
  Instant since{};  ///< since the first one that failed
  std::string reason;
};

/// Where a rig keeps it. One thread. A rig writes before a motor turns and when it has come to rest, before a caller is
/// told so.
class PositionMemory {
 public:
  using Axes = drivers::PerAxis<std::optional<AxisMemory>>;
  virtual ~PositionMemory() = default;
  PositionMemory(const PositionMemory&) = delete;
  PositionMemory& operator=(const PositionMemory&) = delete;

  /// As last saved; nothing for an axis that never was. BadData, Io: it cannot be read, and no position is known.
  virtual Result<Axes> Load() = 0;
  /// Replaces everything; on return it outlives a crash. Io.
  virtual Result<void> Save(const Axes& axes) = 0;

 protected:
  PositionMemory() = default;
};

}  // namespace lensd::rig
