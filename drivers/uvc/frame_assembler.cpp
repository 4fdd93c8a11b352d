// Pictures out of payloads by UVC 1.1, section 2.4.3.3. A picture with a lost or contradictory payload is dropped
// whole.
#include "frame_assembler.h"

#include <utility>

namespace lensd::drivers::uvc {
namespace {

constexpr std::uint8_t kFrameBit = 0x01;
constexpr std::uint8_t kEndOfFrame = 0x02;
constexpr std::uint8_t kError = 0x40;

}  // namespace

void FrameAssembler::OnPayload(std::span<const std::uint8_t> payload) {
  const std::lock_guard lock(mutex_);
  if (payload.empty()) return;
  if (payload.size() < 2 || payload[0] < 2 || payload[0] > payload.size()) {
    building_.damaged = true;
    return;
  }
  const std::uint8_t flags = payload[1];
  const bool frame_bit = (flags & kFrameBit) != 0;
  const auto data = payload.subspan(payload[0]);
  if (!any_ || frame_bit != building_.frame_bit) {
    Finish();  // one whose end was not marked
    // What comes first may be the middle of a picture; only a change of the frame bit shows a beginning.
    const bool whole = any_;
    toggles_ = any_;
    any_ = true;
    Begin(frame_bit);
    building_.missed = !whole;
  } else if (building_.ended) {
    if (data.empty()) return;  // idle packets go on after the end
    // Devices that do not toggle; from one that does, a whole picture is missing.
    if (toggles_) ++next_sequence_;
    Begin(frame_bit);
  }
  if ((flags & kError) != 0) building_.damaged = true;
  building_.came += data.size();
  if (!building_.damaged && !building_.missed && building_.came <= most_bytes_ && !data.empty()) {
    if (building_.frame.bytes.empty()) building_.frame.first = clock_.Now();
    building_.frame.bytes.insert(building_.frame.bytes.end(), data.begin(), data.end());
  }
  if ((flags & kEndOfFrame) != 0) {
    Finish();
    building_.ended = true;
  }
}

void FrameAssembler::OnLoss() {
  const std::lock_guard lock(mutex_);
  // Whether it was part of the picture under way or the gap between two is not known.
  building_.damaged = true;
}

void FrameAssembler::Begin(bool frame_bit) {
  building_.frame_bit = frame_bit;
  building_.open = true;
  building_.ended = false;
  building_.damaged = false;
  building_.missed = false;
  building_.came = 0;
  building_.frame.bytes = std::exchange(spare_, {});
  building_.frame.bytes.clear();
  building_.frame.sequence = next_sequence_++;
}

bool FrameAssembler::Complete() const {
  const auto& bytes = building_.frame.bytes;
  if (building_.damaged || building_.missed || building_.came != bytes.size()) return false;
  if (pixels_ != PixelFormat::Mjpeg) return bytes.size() == most_bytes_;
  return bytes.size() > 4 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

void FrameAssembler::Finish() {
  if (!std::exchange(building_.open, false)) return;
  if (!Complete()) {
    // A picture of no bytes at all is how some devices say that they have none yet.
    if (!building_.missed && (building_.came > 0 || building_.damaged)) {
      counter_.Damaged(building_.frame.sequence, clock_.Now());
      incomplete_ = {incomplete_.count + 1, building_.came, building_.damaged};
    }
    spare_ = std::move(building_.frame.bytes);
    return;
  }
  incomplete_ = {};
  building_.frame.last = clock_.Now();
  counter_.Came(building_.frame.sequence, building_.frame.last);
  if (newest_) spare_ = std::move(newest_->bytes);
  newest_ = std::move(building_.frame);
  building_.frame = {};
}

std::optional<RawFrame> FrameAssembler::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

IncompleteFrames FrameAssembler::TakeIncomplete() {
  const std::lock_guard lock(mutex_);
  return std::exchange(incomplete_, {});
}

void FrameAssembler::Recycle(std::vector<std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (spare_.capacity() == 0) spare_ = std::move(bytes);
}

void FrameAssembler::Restart() {
  const std::lock_guard lock(mutex_);
  building_.open = building_.damaged = building_.ended = any_ = toggles_ = false;
  newest_.reset();
  incomplete_ = {};
  counter_.Restart();
}

}  // namespace lensd::drivers::uvc
