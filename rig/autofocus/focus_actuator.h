// What an autofocus run may do with its lens.
#pragma once

#include <functional>
#include <optional>

#include "autofocus/frame_gate.h"
#include "autofocus/sharpness.h"
#include "rig/rig.h"

namespace lensd::rig {

/// What a run is shown: a frame with the lens during it, and its sharpness where a client measured it.
struct Observation {
  LensedFrame lensed;  ///< without samples where there is only `score`
  std::optional<autofocus::Sharpness> score;
};
using ObservationCallback = std::move_only_function<void(Result<Observation>)>;

/// How a move ends.
enum class Approach {
  BacklashTakenUp,  ///< from the approach side; after a move that ended so as well
  AnyDirection,     ///< the shortest way: only the readings' distance to the mechanism is known
  Reapproach        ///< from the approach side, after a move that has ended
};

/// Each callback comes from a later Step(), and none once the run has ended.
class FocusActuator {
 public:
  virtual ~FocusActuator() = default;
  /// A move displaces the one before.
  virtual void MoveTo(Native target, Approach approach, MoveCallback done) = 0;
  /// To there at a part of the full speed, without taking up backlash.
  virtual void SweepTo(Native target, double part_of_speed, MoveCallback done) = 0;
  virtual void RequestFrame(LensMotion lens, ObservationCallback done) = 0;
  virtual Instant Now() const = 0;
  /// Nothing may be begun that no command asked for just now.
  virtual bool Held() const = 0;
  /// By so many frames the camera's picture is late, as earlier runs have shown; nothing: not known.
  virtual std::optional<int> lag_frames() const = 0;
  /// Of the run before, with frames of a client as well; nothing: there was none.
  virtual std::optional<autofocus::LastFrame> last_frame() const = 0;
  /// Where the frames come from.
  virtual autofocus::FrameGate::Source source() const = 0;
  /// Device motions of the focus axis so far.
  virtual int motions() const = 0;
  /// Tells the caller how far it has come, and goes on with `then`.
  virtual void Report(const AutofocusProgress& progress, std::move_only_function<void()> then) = 0;
  /// Tells the caller an answer while a subject is tracked.
  virtual void Tell(const AutofocusOutcome& answer) = 0;
  /// Called once, last.
  virtual void End(Result<AutofocusOutcome> outcome) = 0;
};

}  // namespace lensd::rig
