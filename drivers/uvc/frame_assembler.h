// From payloads to pictures (UVC 1.1 section 2.4.3.3): each payload has a header of its own, whose frame bit toggles
// with every picture and whose end bit marks the last payload of one. A picture that lost a payload is dropped whole: a
// torn one would mislead a measure of sharpness.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "descriptors.h"
#include "drivers/api/counters.h"
#include "transport.h"

namespace lensd::drivers::uvc {

/// One picture as it came.
struct RawFrame {
  std::vector<std::uint8_t> bytes;
  std::uint64_t sequence = 0;  ///< counts pictures begun, dropped ones included
  Instant first{};             ///< its first payload came
  Instant last{};              ///< its last one
};

/// Pictures that came and are not whole.
struct IncompleteFrames {
  int count = 0;
  std::size_t bytes = 0;      ///< of the newest of them, as far as they came
  bool lost_payload = false;  ///< the newest of them lost one, or had one that makes no sense
};

/// The transport's thread fills it, the camera's thread empties it.
class FrameAssembler final : public PayloadSink {
 public:
  /// `clock` must outlive it. MJPEG pictures have at most `most_bytes`, all others exactly as many.
  FrameAssembler(const Clock& clock, PixelFormat pixels, std::size_t most_bytes, double rate_hz = 0.0)
      : clock_(clock), pixels_(pixels), most_bytes_(most_bytes), counter_(rate_hz) {}

  void OnPayload(std::span<const std::uint8_t> payload) override;
  void OnLoss() override;

  /// The newest complete picture not taken yet.
  std::optional<RawFrame> Take();
  /// Hands the memory of a picture back for the next ones.
  void Recycle(std::vector<std::uint8_t> bytes);
  /// Since the last call, or since the newest whole picture.
  IncompleteFrames TakeIncomplete();
  /// What became of a picture that was taken.
  void TurnedOutDamaged(const RawFrame& frame) { counter_.Damaged(frame.sequence, frame.last); }
  void TurnedOutFlawed() { counter_.Flawed(); }
  Counters counts() const { return counter_.counts(); }
  /// Forgets what was begun; sequence numbers go on.
  void Restart();

 private:
  struct Building {
    RawFrame frame;
    bool open = false;     ///< a picture is being built
    bool damaged = false;  ///< and cannot be completed
    bool missed = false;   ///< its beginning, because nobody listened yet: it is no loss
    std::size_t came = 0;  ///< bytes of it, those that are too many included
    bool ended = false;    ///< the end bit of this frame bit has been seen
    bool frame_bit = false;
  };

  void Begin(bool frame_bit);
  void Finish();
  bool Complete() const;

  const Clock& clock_;
  const PixelFormat pixels_;
  const std::size_t most_bytes_;
  FrameCounter counter_;
  std::mutex mutex_;
  Building building_;
  bool any_ = false;      ///< a payload has been seen since the start
  bool toggles_ = false;  ///< and a change of the frame bit
  std::uint64_t next_sequence_ = 0;
  IncompleteFrames incomplete_;
  std::optional<RawFrame> newest_;
  std::vector<std::uint8_t> spare_;
};

}  // namespace lensd::drivers::uvc
