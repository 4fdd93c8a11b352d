// A frame's way: who waits for one, when it is worth asking the camera, where the lens was during its exposure, and
// whom it satisfies.
#pragma once

#include <optional>
#include <vector>

#include "base/clock.h"
#include "drivers/api/camera.h"
#include "lens_reader.h"
#include "optical_state.h"
#include "replies.h"
#include "rig/rig.h"

namespace lensd::rig {

struct FrameRequest {
  Instant since{};  ///< it is exposed wholly after this
  bool for_autofocus = false;
  LensMotion lens = LensMotion::Standing;
  SnapshotCallback done;
};

/// Streams only while a request waits. A frame satisfies every request from before its exposure.
class FrameRequests {
 public:
  /// `camera` may be nullptr. The others must outlive it.
  FrameRequests(drivers::Camera* camera, const AxisControllers& axes, const LensReader& lens,
                const OpticalState& optics, Replies& replies)
      : camera_(camera), axes_(axes), lens_(lens), optics_(optics), replies_(replies) {}

  /// Unsupported: no camera. Timeout: none came.
  void Add(FrameRequest request);
  /// Drops the requests of autofocus, without an answer.
  void ForgetAutofocus();
  void FailAll(const Error& error);
  bool anyone() const { return !waiting_.empty(); }
  bool streaming() const { return streaming_; }

  /// Before the lens is read: starts or ends the stream (`keep`: frames will soon be wanted again) and asks for a frame
  /// once one exposed wholly after the lens became steady may be there.
  void Poll(Instant now, bool keep);
  /// A frame is there and will be handed out by the first reading from after its exposure.
  bool has_frame() const { return frame_.has_value(); }
  /// After the lens was read: hands out the frame, and ends what has waited too long.
  void Serve(Instant now);
  /// When to ask again, while a request waits and the lens is steady.
  Instant NextPoll(Instant now, Instant steady_since) const;

 private:
  Result<void> SetStreaming(bool wanted);
  Result<void> Ask(Instant now);
  Instant EarliestFrame(Instant steady_since) const;
  Duration Patience() const;
  bool anyone_in_motion() const;
  void HandOut(const drivers::Frame& frame, bool settled);
  LensedFrame WithLens(const drivers::Frame& frame);
  template <class Predicate>
  std::vector<SnapshotCallback> TakeIf(const Predicate& predicate);

  drivers::Camera* camera_;
  const AxisControllers& axes_;
  const LensReader& lens_;
  const OpticalState& optics_;
  Replies& replies_;
  bool streaming_ = false;
  int failures_ = 0;                   ///< polls in a row
  std::optional<Instant> last_start_;  ///< exposure start of the newest frame of this stream
  Duration exposure_{};                ///< and its length
  std::optional<drivers::Frame> frame_;
  Native handed_out_bound_{};  ///< of focus, with the frame before
  std::vector<FrameRequest> waiting_;
};

}  // namespace lensd::rig
