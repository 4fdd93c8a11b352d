// The memory file that lensd passes for frames: slots of equal size.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "loop/descriptor.h"

namespace lensd::drivers::host {

/// Mapped while it lives. Movable.
class MemorySlots {
 public:
  /// InvalidArgument: smaller than that, or its size is not sealed.
  static Result<MemorySlots> Map(const daemon::Descriptor& file, std::int64_t slots, std::int64_t slot_bytes);
  MemorySlots() = default;
  MemorySlots(MemorySlots&& other) noexcept;
  MemorySlots& operator=(MemorySlots&& other) noexcept;
  ~MemorySlots();

  bool mapped() const { return memory_ != nullptr; }
  /// OutOfRange: no such slot, or it is too small.
  Result<void> Write(std::int64_t slot, std::span<const std::uint16_t> samples);

 private:
  std::uint8_t* memory_ = nullptr;
  std::int64_t slots_ = 0;
  std::int64_t slot_bytes_ = 0;
};

}  // namespace lensd::drivers::host
