// A file whose size is sealed cannot be cut short while it is written to, which would end this process by SIGBUS.
#include "memory_slots.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cstring>
#include <utility>

namespace lensd::drivers::host {
namespace {

constexpr std::int64_t kMostSlots = 16;
constexpr std::int64_t kMostSlotBytes = std::int64_t{2} << 30;

}  // namespace

Result<MemorySlots> MemorySlots::Map(const daemon::Descriptor& file, std::int64_t slots, std::int64_t slot_bytes) {
  if (slots < 1 || slots > kMostSlots || slot_bytes < 1 || slot_bytes > kMostSlotBytes) {
    return Fail(Code::InvalidArgument, "slots or slotBytes is out of range");
  }
  struct stat status{};
  if (fstat(file.get(), &status) != 0 || status.st_size < slots * slot_bytes) {
    return Fail(Code::InvalidArgument, "the memory file is smaller than its slots");
  }
  const int seals = fcntl(file.get(), F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0) {
    return Fail(Code::InvalidArgument, "the size of the memory file must be sealed");
  }
  void* memory =
      mmap(nullptr, static_cast<std::size_t>(slots * slot_bytes), PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (memory == MAP_FAILED) return Fail(Code::Io, "the memory file cannot be mapped");
  MemorySlots mapped;
  mapped.memory_ = static_cast<std::uint8_t*>(memory);
  mapped.slots_ = slots;
  mapped.slot_bytes_ = slot_bytes;
  return mapped;
}

MemorySlots::MemorySlots(MemorySlots&& other) noexcept {
  *this = std::move(other);
}

MemorySlots& MemorySlots::operator=(MemorySlots&& other) noexcept {
  std::swap(memory_, other.memory_);
  std::swap(slots_, other.slots_);
  std::swap(slot_bytes_, other.slot_bytes_);
  return *this;
}

MemorySlots::~MemorySlots() {
  if (memory_ != nullptr) munmap(memory_, static_cast<std::size_t>(slots_ * slot_bytes_));
}

Result<void> MemorySlots::Write(std::int64_t slot, std::span<const std::uint16_t> samples) {
  if (slot < 0 || slot >= slots_) return Fail(Code::OutOfRange, "there is no such slot");
  if (static_cast<std::int64_t>(samples.size_bytes()) > slot_bytes_) {
    return Fail(Code::OutOfRange, "the frame does not fit into its slot");
  }
  std::memcpy(memory_ + slot * slot_bytes_, samples.data(), samples.size_bytes());
  return {};
}

}  // namespace lensd::drivers::host
