// Memory that lensd shares with a driver process for frames: slots of equal size.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "loop/descriptor.h"

namespace lensd::drivers::process {

using Samples = std::vector<std::uint16_t>;

/// The process may write into it at any time, so what is used is copied first. Any thread.
class FrameMemory {
 public:
  /// Null where the kernel gives no memory file. Its size cannot be changed by anybody.
  static std::shared_ptr<FrameMemory> Make(std::int64_t slots, std::int64_t slot_bytes);
  ~FrameMemory();
  FrameMemory(const FrameMemory&) = delete;
  FrameMemory& operator=(const FrameMemory&) = delete;

  int descriptor() const { return file_.get(); }
  std::int64_t slots() const { return slots_; }
  std::int64_t slot_bytes() const { return slot_bytes_; }
  /// The first `count` samples of a slot, which must have room for them.
  std::shared_ptr<Samples> Copy(std::int64_t slot, std::size_t count) const;

 private:
  FrameMemory(daemon::Descriptor file, std::int64_t slots, std::int64_t slot_bytes, const std::uint8_t* memory)
      : file_(std::move(file)), slots_(slots), slot_bytes_(slot_bytes), memory_(memory) {}

  const daemon::Descriptor file_;
  const std::int64_t slots_;
  const std::int64_t slot_bytes_;
  const std::uint8_t* const memory_;
};

/// Samples that came inline. Null: not of this many.
std::shared_ptr<Samples> InlineSamples(std::string_view base64, std::size_t count);
/// No sample is above 2^bits - 1 afterwards.
void CutToBits(Samples& samples, int bits);

}  // namespace lensd::drivers::process
