// Pages of the kernel, and blocks of one size in them.
#include "sim/camera/picture_memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <new>

namespace lensd::sim {
namespace {

constexpr std::size_t kSlabBytes = std::size_t{64} << 10;  ///< about, for lights that are smaller
constexpr std::size_t kAlignment = alignof(std::max_align_t);

std::size_t WholePages(std::size_t bytes) {
  static const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return (bytes + page - 1) / page * page;
}

}  // namespace

void* Pages::do_allocate(std::size_t bytes, std::size_t) {
  const std::size_t whole = WholePages(bytes);
  void* const memory = mmap(nullptr, whole, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  bytes_ += whole;
  return memory;
}

void Pages::do_deallocate(void* memory, std::size_t bytes, std::size_t) {
  const std::size_t whole = WholePages(bytes);
  munmap(memory, whole);
  bytes_ -= whole;
}

PictureMemory::PictureMemory(std::size_t light_bytes)
    : light_bytes_(light_bytes),
      block_bytes_((light_bytes + kAlignment - 1) / kAlignment * kAlignment),
      blocks_(std::max<std::size_t>(1, kSlabBytes / block_bytes_)) {}

PictureMemory::~PictureMemory() {
  for (void* const slab : slabs_) pages_.deallocate(slab, blocks_ * block_bytes_);
}

bool PictureMemory::IsSmall(std::size_t bytes) const {
  return bytes <= SmallBlocks::kLargest && bytes != light_bytes_;
}

bool PictureMemory::SharesPages(std::size_t bytes) const {
  return bytes == light_bytes_ && bytes < kSlabBytes;
}

std::size_t PictureMemory::BytesFor(std::size_t bytes) const {
  if (IsSmall(bytes)) return SmallBlocks::BytesFor(bytes);
  return SharesPages(bytes) ? bytes : WholePages(bytes);
}

void* PictureMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  if (!IsSmall(bytes) && !SharesPages(bytes)) return pages_.allocate(bytes, alignment);
  const std::lock_guard lock(mutex_);
  if (IsSmall(bytes)) return small_.Take(bytes);
  if (free_.empty()) AddSlab();
  void* const block = free_.back();
  free_.pop_back();
  return block;
}

void PictureMemory::do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) {
  if (!IsSmall(bytes) && !SharesPages(bytes)) return pages_.deallocate(memory, bytes, alignment);
  const std::lock_guard lock(mutex_);
  if (IsSmall(bytes)) return small_.GiveBack(memory);
  free_.push_back(memory);
}

/// The first of its blocks is taken first: pages that nobody has written to take no memory.
void PictureMemory::AddSlab() {
  slabs_.reserve(slabs_.size() + 1);
  auto* const slab = static_cast<std::byte*>(pages_.allocate(blocks_ * block_bytes_));
  slabs_.push_back(slab);
  for (std::size_t i = blocks_; i-- > 0;) free_.push_back(slab + i * block_bytes_);
}

}  // namespace lensd::sim
