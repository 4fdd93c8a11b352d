// Memory for pictures that are remembered: pages of their own.
//
// A picture stays for hours, what is worked out on the way to it for milliseconds. Of one heap, the pictures would fill
// the holes that the passing leaves, which then takes new memory: a tenth of what the pictures take, and never given
// back.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <utility>
#include <vector>

#include "sim/camera/small_blocks.h"

namespace lensd::sim {

/// Whole pages from the kernel. All calls from any thread.
class Pages final : public std::pmr::memory_resource {
 public:
  /// That are mapped now.
  std::size_t bytes() const { return bytes_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override;
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  std::atomic<std::size_t> bytes_ = 0;
};

/// Blocks of one size, that of a picture's light, without a gap between them; what is small in SmallBlocks (the
/// library's pools crash where the kernel gives no more), all else in pages of its own. What is freed is used again, or
/// given back. All calls from any thread.
class PictureMemory final : public std::pmr::memory_resource {
 public:
  explicit PictureMemory(std::size_t light_bytes);
  ~PictureMemory() override;
  PictureMemory(const PictureMemory&) = delete;
  PictureMemory& operator=(const PictureMemory&) = delete;

  /// What a block takes, about.
  std::size_t BytesFor(std::size_t bytes) const;
  /// What has been taken from the kernel.
  std::size_t bytes() const { return pages_.bytes(); }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override;
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
  bool IsSmall(std::size_t bytes) const;
  bool SharesPages(std::size_t bytes) const;
  void AddSlab();

  const std::size_t light_bytes_;
  const std::size_t block_bytes_;  ///< of a slab
  const std::size_t blocks_;       ///< of a slab
  Pages pages_;
  std::mutex mutex_;
  std::vector<void*> free_;    // guarded by mutex_
  std::vector<void*> slabs_;   // guarded by mutex_
  SmallBlocks small_{pages_};  // guarded by mutex_
};

/// An allocator that keeps the memory for as long as anything is in it.
template <class T>
struct InPictureMemory {
  using value_type = T;

  explicit InPictureMemory(std::shared_ptr<PictureMemory> kept) : memory(std::move(kept)) {}
  template <class U>
  InPictureMemory(const InPictureMemory<U>& other) : memory(other.memory) {}  // NOLINT(google-explicit-constructor)

  T* allocate(std::size_t count) { return static_cast<T*>(memory->allocate(count * sizeof(T), alignof(T))); }
  void deallocate(T* at, std::size_t count) { memory->deallocate(at, count * sizeof(T), alignof(T)); }
  template <class U>
  bool operator==(const InPictureMemory<U>& other) const {
    return memory == other.memory;
  }

  std::shared_ptr<PictureMemory> memory;
};

}  // namespace lensd::sim
