// A page begins with its own record; its free blocks are a list that begins there.
#include "sim/camera/small_blocks.h"

#include <unistd.h>

#include <cstdint>
#include <new>

namespace lensd::sim {
namespace {

std::size_t PageBytes() {
  static const auto bytes = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return bytes;
}

struct FreeBlock {
  FreeBlock* next;
};

}  // namespace

struct alignas(SmallBlocks::kUnit) SmallBlocks::Page {
  std::size_t units;               ///< of a block
  std::size_t in_use = 0;          ///< blocks
  FreeBlock* free = nullptr;       ///< that were in use before
  std::byte* untouched = nullptr;  ///< where blocks begin that never were in use, which have no memory yet
  Page* before = nullptr;          ///< among those with room
  Page* after = nullptr;

  std::byte* begin() { return reinterpret_cast<std::byte*>(this); }
  std::size_t block_bytes() const { return units * kUnit; }
  bool HasRoom() { return free != nullptr || untouched + block_bytes() <= begin() + PageBytes(); }
  static Page& Of(void* block) {
    const std::size_t into_page = reinterpret_cast<std::uintptr_t>(block) % PageBytes();
    return *reinterpret_cast<Page*>(static_cast<std::byte*>(block) - into_page);
  }
};

void* SmallBlocks::Take(std::size_t bytes) {
  const std::size_t units = UnitsOf(bytes);
  Page* const page = with_room_[units] != nullptr ? with_room_[units] : AddPage(units);
  void* block = page->free;
  if (page->free != nullptr) {
    page->free = page->free->next;
  } else {
    block = page->untouched;
    page->untouched += page->block_bytes();
  }
  ++page->in_use;
  if (!page->HasRoom()) Unlink(*page);
  return block;
}

void SmallBlocks::GiveBack(void* block) {
  Page& page = Page::Of(block);
  if (!page.HasRoom()) Link(page);
  page.free = new (block) FreeBlock{page.free};
  if (--page.in_use > 0) return;
  Unlink(page);
  pages_.deallocate(&page, PageBytes());
}

std::size_t SmallBlocks::BytesFor(std::size_t bytes) {
  const std::size_t block_bytes = UnitsOf(bytes) * kUnit;
  const std::size_t blocks = (PageBytes() - sizeof(Page)) / block_bytes;
  return (PageBytes() + blocks - 1) / blocks;
}

SmallBlocks::Page* SmallBlocks::AddPage(std::size_t units) {
  Page* const page = new (pages_.allocate(PageBytes())) Page{units};
  page->untouched = page->begin() + sizeof(Page);
  Link(*page);
  return page;
}

void SmallBlocks::Link(Page& page) {
  Page*& first = with_room_[page.units];
  page.before = nullptr;
  page.after = first;
  if (first != nullptr) first->before = &page;
  first = &page;
}

void SmallBlocks::Unlink(Page& page) {
  (page.before != nullptr ? page.before->after : with_room_[page.units]) = page.after;
  if (page.after != nullptr) page.after->before = page.before;
}

}  // namespace lensd::sim
