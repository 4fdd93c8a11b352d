// What a rig can be told to do with an axis, and what it says when it is done.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/lens.h"
#include "optics/focus_scale.h"

namespace lensd::rig {

/// Where an axis should go.
struct Target {
  enum class Kind {
    Native,          ///< native units, absolute; any axis
    NativeRelative,  ///< native units from where the axis was last told to go, or stands
    TowardNear,      ///< focus: native units nearer (negative: farther), whatever the wiring
    Vergence,        ///< focus: dioptres from the lens centre
    Distance,        ///< focus: metres from the configured origin
    Extension,       ///< focus: metres
    FNumber,         ///< iris
    FocalLength,     ///< zoom: metres
  };
  Kind kind = Kind::Native;
  double value = 0.0;                        ///< in the unit the kind names
  std::optional<optics::DistanceFrom> from;  ///< Distance only: instead of the configured origin
  std::optional<double> take_up = {};        ///< native units, instead of the axis' backlash; 0: straight there
};

/// Why a motion did not arrive, or what its reader should know all the same; `reason` has it in words.
enum class MoveCause {
  None,
  Counted,
  NoFeedback,
  PositionUnknown,
  Backlash,
  Missed,
  External,
  Fault,
  Stalled,
  Late,
  NoReference,
  FocusLost,
  NotKept,
};

struct Trouble {
  MoveCause cause = MoveCause::None;
  std::string reason;  ///< empty: none
};

/// The end of a motion that was carried out, well or not. A motion that was never carried out (superseded, stopped,
/// device gone) is an Error instead.
struct MoveOutcome {
  drivers::Axis axis = drivers::Axis::Focus;
  bool reached = false;             ///< stands at the target within tolerance
  bool settled = false;             ///< and has stood long enough to take a picture
  bool verified = false;            ///< measured, not merely commanded or counted: an encoder, or the reference itself
  Native position;                  ///< where it stands
  Native bound;                     ///< the true position is within this of `position` as far as is known
  std::optional<Metres> extension;  ///< focus with known optics
  std::optional<Metres> extension_bound;
  std::optional<Dioptres> vergence;
  std::optional<Dioptres> vergence_bound;  ///< of the true plane in focus; the focal length's tolerance counts
  std::optional<FNumber> f_number;         ///< iris with known optics
  std::optional<FNumber> f_number_bound;
  std::optional<Metres> focal_length;  ///< zoom with known optics
  std::optional<Metres> focal_length_bound;
  bool missed = false;            ///< came to rest elsewhere, as often as it was tried
  bool moved_by_another = false;  ///< another program moved the axis meanwhile; it stands where that left it
  MoveCause cause = MoveCause::None;
  std::string reason;             ///< empty when all is well, else one line for people
  std::optional<bool> kept = {};  ///< where it rests is on disk; nothing: nothing is kept, or it did not arrive
  Duration elapsed{};
};

/// What is known of the end of an axis' next motion before it begins.
struct Arrival {
  Native position;  ///< now
  Native minimum;   ///< soft limits
  Native maximum;
  bool upward = true;         ///< the side it arrives from
  bool overshoots = false;    ///< where need be, to take up its backlash
  double backlash = 0.0;      ///< native units: the travel that takes all of it up
  double not_taken_up = 0.0;  ///< of it, now
  double rest = 0.0;          ///< native units: everything else the mechanism may be off by
  double lost_travel = 0.0;   ///< part of the travel that may be lost
  /// The mechanism will stand within this of `target` once a motion has ended there.
  Native BoundAt(Native target) const;
  bool operator==(const Arrival&) const = default;
};

using MoveCallback = std::move_only_function<void(Result<MoveOutcome>)>;

}  // namespace lensd::rig
