// The file is sealed against every change of its size: no process can make a copy from it end by SIGBUS.
#include "frame_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

#include "varlink/base64.h"

namespace lensd::drivers::process {

std::shared_ptr<FrameMemory> FrameMemory::Make(std::int64_t slots, std::int64_t slot_bytes) {
  daemon::Descriptor file(memfd_create("lensd-frames", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!file || ftruncate(file.get(), slots * slot_bytes) != 0) return nullptr;
  if (fcntl(file.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) return nullptr;
  const auto size = static_cast<std::size_t>(slots * slot_bytes);
  void* memory = mmap(nullptr, size, PROT_READ, MAP_SHARED, file.get(), 0);
  if (memory == MAP_FAILED) return nullptr;
  return std::shared_ptr<FrameMemory>(
      new FrameMemory(std::move(file), slots, slot_bytes, static_cast<const std::uint8_t*>(memory)));
}

FrameMemory::~FrameMemory() {
  munmap(const_cast<std::uint8_t*>(memory_), static_cast<std::size_t>(slots_ * slot_bytes_));
}

std::shared_ptr<Samples> FrameMemory::Copy(std::int64_t slot, std::size_t count) const {
  auto samples = std::make_shared<Samples>(count);
  std::memcpy(samples->data(), memory_ + slot * slot_bytes_, count * sizeof(std::uint16_t));
  return samples;
}

std::shared_ptr<Samples> InlineSamples(std::string_view base64, std::size_t count) {
  const auto bytes = varlink::DecodeBase64(base64);
  if (!bytes || bytes->size() != count * sizeof(std::uint16_t)) return nullptr;
  auto samples = std::make_shared<Samples>(count);
  for (std::size_t i = 0; i < count; ++i) {
    (*samples)[i] = static_cast<std::uint16_t>((*bytes)[2 * i] | ((*bytes)[2 * i + 1] << 8));
  }
  return samples;
}

void CutToBits(Samples& samples, int bits) {
  if (bits >= 16) return;
  const auto most = static_cast<std::uint16_t>((1 << bits) - 1);
  for (std::uint16_t& sample : samples) sample = std::min(sample, most);
}

}  // namespace lensd::drivers::process
