// Frames from a camera that the rig does not drive: which one is wanted, and whether the one that came is it.
#pragma once

#include <functional>
#include <optional>

#include "autofocus/sharpness.h"
#include "rig/rig.h"

namespace lensd::rig {

/// What an autofocus run is shown: a frame with the lens during it, and its sharpness where somebody else measured it.
struct Seen {
  LensedFrame lensed;  ///< without samples where there is only `score`
  std::optional<autofocus::Sharpness> score;
};
using SeenCallback = std::move_only_function<void(Result<Seen>)>;

/// A frame or score as it came.
struct Given {
  drivers::Frame frame;
  std::optional<autofocus::Sharpness> score;
  StopCallback taken;
};

/// The desk of one run: at most one frame is wanted and at most one waits to be judged.
class Outside {
 public:
  explicit Outside(OutsideCamera camera) : camera_(std::move(camera)) {}

  const OutsideCamera& camera() const { return camera_; }
  /// Wants a frame exposed from `since` on.
  void Want(Instant since, SeenCallback seen);
  /// Tells the outside, once for every frame wanted, as soon as the lens has been steady since `steady_since`.
  void Announce(Instant now, std::optional<Instant> steady_since, FrameWanted wanted);
  /// Takes in what came; an error where nothing is wanted, another one waits already, it is a picture where scores are
  /// wanted or the other way round, or another size of picture than before.
  Result<void> Take(Given given, StopCallback& refused);
  /// The frame to be judged, if any: a reading of the lens from after its exposure is needed.
  const std::optional<Given>& given() const { return given_; }
  bool unannounced() const { return seen_ && !announced_; }
  /// Why the frame that waits is not the one wanted; nothing if it is.
  std::optional<std::string> WhatIsWrong(std::optional<Instant> steady_since) const;
  /// Ends the judging: the frame is used, and who wanted it gets it ...
  std::pair<Given, SeenCallback> Accept();
  /// ... or it is refused and the same one is still wanted; announced again where the lens has moved meanwhile.
  StopCallback Refuse(bool announce_again);

 private:
  OutsideCamera camera_;
  SeenCallback seen_;
  Instant since_{};
  bool announced_ = false;
  std::optional<std::pair<int, int>> size_;  ///< px, of the first frame used
  std::optional<Given> given_;
};

}  // namespace lensd::rig
