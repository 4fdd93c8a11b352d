// A frame's way: who waits for one or looks on, when it is worth asking the camera, where the lens was during its
// exposure, and whom it satisfies.
#pragma once

#include <optional>
#include <vector>

#include "base/clock.h"
#include "drivers/api/camera.h"
#include "rig/calibration/optical_state.h"
#include "rig/common/replies.h"
#include "rig/frames/lens_reader.h"
#include "rig/rig.h"

namespace lensd::rig {

struct FrameRequest {
  Instant since{};  ///< it is exposed wholly after this
  bool for_autofocus = false;
  LensMotion lens = LensMotion::Standing;
  SnapshotCallback done;
};

/// Streams only while a request waits or a viewer looks on. A frame satisfies every request from before its exposure.
class FrameRequests {
 public:
  /// `camera` may be nullptr. The others must outlive it.
  FrameRequests(drivers::Camera* camera, const AxisControllers& axes, const LensReader& lens,
                const OpticalState& optics, Replies& replies)
      : camera_(camera), axes_(axes), lens_(lens), optics_(optics), replies_(replies) {}

  /// Unsupported: no camera. Timeout: none came.
  void Add(FrameRequest request);
  /// Unsupported: no camera.
  Result<void> View(FrameViewer viewer);
  /// Drops the requests of autofocus, without an answer.
  void ForgetAutofocus();
  /// Answers all requests and ends all views with it.
  void FailAll(const Error& error);
  bool any() const { return !waiting_.empty(); }
  bool streaming() const { return stream_.on; }

  /// Before the lens is read: starts or ends the stream (`keep`: frames will soon be wanted again, by a caller for whom
  /// a camera that makes them on demand is kept free of viewers) and asks for a frame once one exposed wholly after the
  /// lens became steady, or due to a viewer, may be there.
  void Poll(Instant now, bool keep);
  /// A frame is there and will be handed out by the first reading from after its exposure.
  bool has_frame() const { return frame_.has_value(); }
  /// After the lens was read: hands out the frame, and ends what has waited too long.
  void Serve(Instant now);
  /// When to ask again, while a request waits and the lens is steady.
  Instant NextPoll(Instant now, Instant steady_since) const;
  /// When a viewer may get the next frame, or the last of them is gone and the stream is to end; nothing: none looks
  /// on, or only at what others ask for.
  std::optional<Instant> NextView(Instant now) const;

 private:
  struct Stream {
    bool on = false;
    bool kept = false;  ///< for a caller that must not wait for frames that are made for viewers
    int failures = 0;   ///< polls in a row
    /// Since when frames come of which none can be used; nothing: one could be.
    std::optional<Instant> unusable_since{};
  };
  /// What is known of the stream's frames in time.
  struct Beat {
    std::optional<Instant> last_start;  ///< exposure start of the newest frame
    Duration exposure{};                ///< and its length
  };
  struct Onlooker {
    FrameViewer viewer;
    Instant next{};   ///< exposures that begin earlier are not shown
    Instant heard{};  ///< when the camera last gave a frame, or was not asked on the viewer's behalf
  };
  /// The times of Serve().
  struct Service {
    Instant last{};
    Instant spared_until{};  ///< nothing is late before this
  };
  bool MayBeLate(Instant now);
  bool SparesOthers() const;
  bool IsShown(const Onlooker& onlooker) const;
  bool ViewIsDue(Instant now) const;
  void Show(const LensedFrame& frame, bool moved);
  void EndLateViews(Instant now);
  Result<void> SetStreaming(bool wanted);
  Result<void> Ask(Instant now);
  Result<void> JudgeUnusable(Instant now);
  Error NoneInTime() const;
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
  Stream stream_;
  Beat beat_;
  std::optional<drivers::Frame> frame_;
  Native handed_out_bound_{};  ///< of focus, with the frame before
  Service service_;
  std::vector<FrameRequest> waiting_;
  std::vector<Onlooker> onlookers_;
};

}  // namespace lensd::rig
