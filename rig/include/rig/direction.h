// Which way focus counts, and who says so.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "drivers/api/lens.h"
#include "rig/calibration.h"
#include "rig/config.h"
#include "rig/optics_table.h"

namespace lensd::rig {

/// Who says which way focus counts. Of several the one that stands first here is believed.
enum class DirectionFrom {
  Configured,   ///< the key `direction`
  Calibration,  ///< measured distances
  Seen,         ///< a measurement of the direction alone, such as that of `lensctl setup`
  Driver,       ///< a standard or the maker of the device
  Nobody
};

struct FocusDirection {
  std::optional<drivers::Direction> direction;  ///< nothing: nobody says
  DirectionFrom from = DirectionFrom::Nobody;
  std::string by;             ///< of a driver: what fixes it, for people; else empty
  bool approach_near = true;  ///< the last motion goes toward near; means nothing while the direction is not known
  bool approach_up = true;    ///< it goes toward larger positions
  std::string warning;        ///< for people: who says otherwise, or what cannot be done; empty where all is well

  bool near_positive() const { return direction == drivers::Direction::NearPositive; }
};

/// Of a focus axis; `calibration` may be null.
FocusDirection DirectionOf(const AxisConfig& config, const drivers::AxisCapabilities& can,
                           const Calibration* calibration);

/// Whether positions of a measured curve focus nearer as they grow; nothing: its points do not tell.
std::optional<drivers::Direction> DirectionOf(const FocusCurve& curve);

/// All that distances take is known of this lens but the direction of its focus.
inline bool LacksDirection(const OpticsTable& optics) {
  return optics.has_focus(OpticsTable::Direction::NotNeeded) && !optics.has_focus();
}

/// What setup has seen, and the file it is kept in.
Result<drivers::Direction> ReadSeenDirection(const Settings& file);
std::string SeenDirectionText(drivers::Direction seen, const std::string& made);

/// Unsupported: `what` cannot be done while the direction is not known. The message says how to make it known.
Error DirectionUnknown(std::string_view what);

}  // namespace lensd::rig
