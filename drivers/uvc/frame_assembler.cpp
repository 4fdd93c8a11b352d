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
    damaged_ = true;
    return;
  }
  const std::uint8_t flags = payload[1];
  const bool frame_bit = (flags & kFrameBit) != 0;
  const auto data = payload.subspan(payload[0]);
  if (!any_ || frame_bit != frame_bit_) {
    Finish();  // one whose end was not marked
    // What comes first may be the middle of a picture; only a change of the frame bit shows a beginning.
    const bool whole = any_;
    any_ = true;
    Begin(frame_bit);
    damaged_ = !whole;
  } else if (ended_) {
    if (data.empty()) return;  // idle packets go on after the end
    // Devices that do not toggle.
    Begin(frame_bit);
  }
  if ((flags & kError) != 0) damaged_ = true;
  if (!damaged_ && building_.bytes.size() + data.size() > most_bytes_) damaged_ = true;
  if (!damaged_ && !data.empty()) {
    if (building_.bytes.empty()) building_.first = clock_.Now();
    building_.bytes.insert(building_.bytes.end(), data.begin(), data.end());
  }
  if ((flags & kEndOfFrame) != 0) {
    Finish();
    ended_ = true;
  }
}

void FrameAssembler::OnLoss() {
  const std::lock_guard lock(mutex_);
  // Whether it was part of the picture under way or the gap between two, nobody knows.
  damaged_ = true;
}

void FrameAssembler::Begin(bool frame_bit) {
  frame_bit_ = frame_bit;
  open_ = true;
  ended_ = false;
  damaged_ = false;
  building_.bytes = std::exchange(spare_, {});
  building_.bytes.clear();
  building_.sequence = next_sequence_++;
}

bool FrameAssembler::Complete() const {
  const auto& bytes = building_.bytes;
  if (damaged_) return false;
  if (pixels_ == PixelFormat::Yuyv) return bytes.size() == most_bytes_;
  return bytes.size() > 4 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

void FrameAssembler::Finish() {
  if (!std::exchange(open_, false)) return;
  if (!Complete()) {
    spare_ = std::move(building_.bytes);
    return;
  }
  building_.last = clock_.Now();
  if (newest_) spare_ = std::move(newest_->bytes);
  newest_ = std::move(building_);
  building_ = {};
}

std::optional<RawFrame> FrameAssembler::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

void FrameAssembler::Recycle(std::vector<std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (spare_.capacity() == 0) spare_ = std::move(bytes);
}

void FrameAssembler::Restart() {
  const std::lock_guard lock(mutex_);
  open_ = damaged_ = ended_ = any_ = false;
  newest_.reset();
}

}  // namespace lensd::drivers::uvc
