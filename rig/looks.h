// The camera's desk: who waits for a frame, when it is worth asking for one, and which frame satisfies whom.
#pragma once

#include <optional>
#include <vector>

#include "base/clock.h"
#include "drivers/api/camera.h"
#include "rig/rig.h"

namespace lensd::rig {

/// Streams only while somebody waits. A frame satisfies everyone whose request came before its exposure began.
class Looks {
 public:
  explicit Looks(drivers::Camera* camera) : camera_(camera) {}  ///< nullptr: none

  struct Waiting {
    Instant since{};
    bool for_autofocus = false;
    bool in_motion_too = false;  ///< frames of a moving lens will do
    SnapshotCallback done;
  };
  void Add(Waiting waiting) { waiting_.push_back(std::move(waiting)); }
  /// Takes away whoever waits on behalf of autofocus, without a word.
  void ForgetAutofocus();
  bool anyone() const { return !waiting_.empty(); }
  bool streaming() const { return streaming_; }

  /// Starts or ends the stream (`keep`: somebody will soon want frames again) and, where the lens has been steady since
  /// `steady_since`, asks for a frame once one exposed wholly after that may be there. It stays until dropped.
  Result<void> Poll(Instant now, std::optional<Instant> steady_since, bool keep);
  const std::optional<drivers::Frame>& frame() const { return frame_; }
  void DropFrame() { frame_.reset(); }
  /// Everyone who may have a frame exposed from `begin` on, of a lens that stood or moved.
  std::vector<SnapshotCallback> TakeSatisfied(Instant begin, bool moved);
  /// Somebody waits whom frames of a moving lens serve.
  bool anyone_in_motion() const;
  /// Everyone who has waited too long: since their request, and since the lens became steady.
  std::vector<SnapshotCallback> TakeExpired(Instant now, std::optional<Instant> steady_since);
  std::vector<SnapshotCallback> TakeAll();
  /// When to ask again, while somebody waits and the lens is steady.
  Instant NextPoll(Instant now, Instant steady_since) const;

 private:
  Result<void> SetStreaming(bool wanted);
  Instant EarliestFrame(Instant steady_since) const;
  bool MayPoll(Instant now, std::optional<Instant> steady_since) const;

  drivers::Camera* camera_;
  bool streaming_ = false;
  int failures_ = 0;                   ///< polls in a row
  std::optional<Instant> last_start_;  ///< exposure start of the newest frame of this stream
  Duration exposure_{};                ///< and its length
  std::optional<drivers::Frame> frame_;
  std::vector<Waiting> waiting_;
};

}  // namespace lensd::rig
