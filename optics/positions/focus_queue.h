// Positions of focus in rising order of a key. Blocks wait beside positions with a key that none of their positions can
// be below; only those that come first are looked into.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "optics/focus_blocks.h"
#include "optics/positions/index_stretches.h"

namespace lensd::optics {

/// What counts first, and what counts where that is equal.
using FocusKey = std::pair<double, double>;
inline constexpr FocusKey kFirstOfAll{-std::numeric_limits<double>::infinity(),
                                      -std::numeric_limits<double>::infinity()};

/// `KeyOfBlock` takes a FocusRange that is sound, `KeyOfPosition` an index; either gives a key, or nothing where no
/// position is of interest. Of equal keys the lower index comes first. All arguments must outlive it.
template <class KeyOfBlock, class KeyOfPosition>
class FocusQueue {
 public:
  struct Found {
    FocusKey key;
    std::size_t position = 0;
  };

  FocusQueue(const FocusBlocks& blocks, const IndexStretches& among, KeyOfBlock key_of_block,
             KeyOfPosition key_of_position)
      : blocks_(blocks),
        among_(among),
        key_of_block_(std::move(key_of_block)),
        key_of_position_(std::move(key_of_position)) {
    const std::size_t top = blocks_.levels();
    for (std::size_t block = 0; block < blocks_.OfLevel(top).size(); ++block) AddBlock(top, block);
  }

  /// The next position; nothing where there is none, or none whose key starts with `most` or less.
  std::optional<Found> Next(double most = std::numeric_limits<double>::infinity()) {
    while (!waiting_.empty() && waiting_.front().key.first <= most) {
      std::ranges::pop_heap(waiting_, std::greater<>());
      const Waiting next = waiting_.back();
      waiting_.pop_back();
      if (next.level == 0) return Found{next.key, next.index};
      const auto [first, end] = blocks_.PartsOf(next.level, next.index);
      for (std::size_t part = first; part < end; ++part) {
        next.level == 1 ? AddPosition(part) : AddBlock(next.level - 1, part);
      }
    }
    return std::nullopt;
  }

 private:
  struct Waiting {
    FocusKey key;
    std::size_t level = 0;
    std::size_t index = 0;
    /// A block may hold what comes before a position of the same key.
    bool operator>(const Waiting& other) const {
      if (key != other.key) return key > other.key;
      return level != other.level ? level < other.level : index > other.index;
    }
  };

  void AddBlock(std::size_t level, std::size_t block) {
    const auto [first, end] = blocks_.PositionsOf(level, block);
    if (!among_.AnyOf(first, end)) return;
    const FocusRange& range = blocks_.OfLevel(level)[block];
    if (!range.sound) return Add({kFirstOfAll, level, block});
    if (const auto key = key_of_block_(range)) Add({*key, level, block});
  }
  void AddPosition(std::size_t position) {
    if (!among_.Contains(position)) return;
    if (const auto key = key_of_position_(position)) Add({*key, 0, position});
  }
  void Add(const Waiting& waiting) {
    waiting_.push_back(waiting);
    std::ranges::push_heap(waiting_, std::greater<>());
  }

  const FocusBlocks& blocks_;
  const IndexStretches& among_;
  KeyOfBlock key_of_block_;
  KeyOfPosition key_of_position_;
  std::vector<Waiting> waiting_;
};

}  // namespace lensd::optics
