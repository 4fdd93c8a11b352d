// Frames on their way from Aravis' stream thread to the thread that polls.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "base/clock.h"
#include "base/result.h"
#include "config.h"
#include "drivers/api/counters.h"
#include "drivers/api/thread_barrier.h"
#include "gobject_handles.h"

// Aravis names them so.
using ArvBuffer = struct _ArvBuffer;  // NOLINT(bugprone-reserved-identifier)
using ArvStream = struct _ArvStream;  // NOLINT(bugprone-reserved-identifier)

namespace lensd::drivers::aravis {

/// A frame as it came.
struct RawFrame {
  Handle<ArvBuffer> buffer;
  std::uint64_t sequence = 0;   ///< counts frames exposed, across streams of one camera
  std::uint64_t device_ns = 0;  ///< stamp of the camera's clock
  Instant arrival{};            ///< of its first packet
};

/// Where the newest frame waits. Any thread.
class Mailbox {
 public:
  /// 0: frames come when they are asked for.
  explicit Mailbox(double rate_hz) : counter_(rate_hz) {}
  /// Takes the newest frame not yet taken. Throws what Aravis' stream thread met in our callback.
  std::optional<RawFrame> Take();
  Counters counts() const { return counter_.counts(); }

 private:
  friend class Stream;
  /// Puts a frame in; the one it replaces comes back.
  Handle<ArvBuffer> Put(RawFrame frame, std::uint64_t frame_id);
  void NoteIncomplete(std::uint64_t frame_id);
  void Begin();
  void Clear();
  void Advance(std::uint64_t frame_id);

  FrameCounter counter_;
  ThreadBarrier barrier_;
  mutable std::mutex mutex_;
  std::optional<RawFrame> newest_;        // guarded by mutex_, as all below
  std::uint64_t sequence_ = 0;            ///< of the newest frame heard of
  std::optional<std::uint64_t> last_id_;  ///< as the camera counts
};

/// One stream, from start to stop of acquisition. Used by the link's thread but for Return().
class Stream {
 public:
  /// Starts acquisition; frames go to `mailbox`. Errors as Camera::Start().
  static Result<std::shared_ptr<Stream>> Start(ArvCamera* camera, const CameraConfig& config,
                                               std::shared_ptr<Mailbox> mailbox);
  /// Ends the stream without a word to the camera.
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Ends acquisition.
  Result<void> Stop(ArvCamera* camera);
  /// Brings the counts of packets up to date.
  void Count();
  /// Gives a buffer back to be filled again. Any thread.
  void Return(Handle<ArvBuffer> buffer);

 private:
  explicit Stream(std::shared_ptr<Mailbox> mailbox) : mailbox_(std::move(mailbox)) {}
  static void Callback(void* self, int type, ArvBuffer* buffer);
  void Done();

  const std::shared_ptr<Mailbox> mailbox_;
  Handle<ArvStream> stream_;
  std::atomic<ArvStream*> running_{nullptr};  ///< stream_, for the threads
  std::uint64_t missing_ = 0;                 ///< packets, counted so far
  std::uint64_t resent_ = 0;
};

}  // namespace lensd::drivers::aravis
