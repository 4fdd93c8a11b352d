// Memory for small records that stay: pages of their own, beside those of the pictures that the records belong to.
#pragma once

#include <array>
#include <cstddef>
#include <memory_resource>

namespace lensd::sim {

/// Blocks of at most kLargest bytes. Each page has blocks of one size, and goes back when its last block is free. One
/// thread at a time.
class SmallBlocks {
 public:
  static constexpr std::size_t kLargest = 512;
  /// Bytes: blocks have whole units, and begin at whole units of their page.
  static constexpr std::size_t kUnit = 16;

  /// `pages` gives memory that begins where a page of the kernel begins. It must outlive the blocks, which must all be
  /// free at the end.
  explicit SmallBlocks(std::pmr::memory_resource& pages) : pages_(pages) {}
  SmallBlocks(const SmallBlocks&) = delete;
  SmallBlocks& operator=(const SmallBlocks&) = delete;

  /// Throws std::bad_alloc where `pages` does.
  void* Take(std::size_t bytes);
  void GiveBack(void* block);
  /// What one of many blocks takes.
  static std::size_t BytesFor(std::size_t bytes);

 private:
  struct Page;
  Page* AddPage(std::size_t units);
  void Link(Page& page);
  void Unlink(Page& page);

  static std::size_t UnitsOf(std::size_t bytes) { return bytes == 0 ? 1 : (bytes + kUnit - 1) / kUnit; }

  std::pmr::memory_resource& pages_;
  std::array<Page*, kLargest / kUnit + 1> with_room_{};  ///< by units of a block: the first page with a free block
};

}  // namespace lensd::sim
