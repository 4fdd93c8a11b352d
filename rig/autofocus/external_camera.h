// Frames from a camera that the rig does not drive: which one is wanted, and whether the one that came is it.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "rig/autofocus/focus_actuator.h"
#include "rig/rig.h"

namespace lensd::rig {

/// A frame or score as it came.
struct SubmittedFrame {
  drivers::Frame frame;
  std::optional<autofocus::Sharpness> score;
  StopCallback taken;
};

/// Of one run: at most one frame is wanted and at most one waits to be judged.
class ExternalCamera {
 public:
  explicit ExternalCamera(OutsideCamera camera) : camera_(std::move(camera)) {}

  const OutsideCamera& camera() const { return camera_; }
  /// Wants a frame exposed from `since` on.
  void Want(Instant since, ObservationCallback done);
  bool unannounced() const { return done_ && !announced_; }
  /// The lens stands where the frame is wanted since `steady_since`, and the outside is told now: when exposures may
  /// begin.
  Instant Announce(Instant steady_since);
  /// InvalidArgument where nothing is wanted, another one waits already, it is a picture where scores are wanted or the
  /// other way round, or another size of picture than before.
  Result<void> Check(const SubmittedFrame& frame) const;
  /// Takes in what passed the check.
  void Take(SubmittedFrame frame) { submitted_ = std::move(frame); }
  /// The frame to be judged, if any: a reading of the lens from after its exposure is needed.
  const std::optional<SubmittedFrame>& submitted() const { return submitted_; }
  /// Why the frame that waits is not the one wanted; nothing if it is.
  std::optional<Error> WhatIsWrong(std::optional<Instant> steady_since) const;
  /// Ends the judging: the frame is used, and who wanted it gets it ...
  std::pair<SubmittedFrame, ObservationCallback> Accept();
  /// ... or it is refused and the same one is still wanted; announced again where the lens has moved meanwhile.
  StopCallback Refuse();
  void AnnounceAgain() { announced_ = false; }

 private:
  OutsideCamera camera_;
  ObservationCallback done_;
  Instant since_{};
  bool announced_ = false;
  std::optional<std::pair<int, int>> size_;  ///< px, of the first frame used
  std::optional<SubmittedFrame> submitted_;
};

}  // namespace lensd::rig
