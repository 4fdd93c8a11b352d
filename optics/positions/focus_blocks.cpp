// A block's ends are those of its parts: of positions at first, then of blocks, eight at a time.
#include "optics/focus_blocks.h"

#include <algorithm>
#include <cmath>

#include "optics/lens_positions.h"

namespace lensd::optics {

namespace {

using FocusEnds = FocusRange::Ends;

void Widen(FocusEnds& ends, const FocusEnds& more) {
  ends.low = std::min(ends.low, more.low);
  ends.high = std::max(ends.high, more.high);
}

void Widen(FocusRange& range, const FocusRange& more) {
  Widen(range.focal_length, more.focal_length);
  Widen(range.extension, more.extension);
  Widen(range.sensor_distance, more.sensor_distance);
  Widen(range.focal_plane, more.focal_plane);
  Widen(range.bound, more.bound);
  range.sound = range.sound && more.sound;
}

FocusRange RangeOf(const FocusPosition& position) {
  const auto only = [](auto quantity) { return FocusEnds{quantity.value, quantity.value}; };
  FocusRange range{only(position.focal_length), only(position.extension), only(position.sensor_distance),
                   only(position.focal_plane), only(position.bound)};
  for (const FocusEnds& ends :
       {range.focal_length, range.extension, range.sensor_distance, range.focal_plane, range.bound}) {
    range.sound = range.sound && std::isfinite(ends.low);
  }
  range.sound = range.sound && range.focal_length.low > 0.0 && range.sensor_distance.low > 0.0;
  return range;
}

/// Blocks of `parts`, each as `range_of` says.
template <class Part, class RangeOfPart>
std::vector<FocusRange> Blocks(const std::vector<Part>& parts, const RangeOfPart& range_of) {
  std::vector<FocusRange> blocks((parts.size() + FocusBlocks::kOfABlock - 1) / FocusBlocks::kOfABlock);
  for (std::size_t i = 0; i < parts.size(); ++i) Widen(blocks[i / FocusBlocks::kOfABlock], range_of(parts[i]));
  return blocks;
}

}  // namespace

FocusBlocks::FocusBlocks(const std::vector<FocusPosition>& positions) : positions_(positions.size()) {
  blocks_.push_back(Blocks(positions, RangeOf));
  while (blocks_.back().size() > kOfABlock) {
    auto larger = Blocks(blocks_.back(), [](const FocusRange& range) { return range; });
    blocks_.push_back(std::move(larger));
  }
}

FocusBlocks::Parts FocusBlocks::PartsOf(std::size_t level, std::size_t block) const {
  const std::size_t all = level == 1 ? positions_ : blocks_[level - 2].size();
  return {block * kOfABlock, std::min((block + 1) * kOfABlock, all)};
}

FocusBlocks::Parts FocusBlocks::PositionsOf(std::size_t level, std::size_t block) const {
  std::size_t each = kOfABlock;
  for (std::size_t i = 1; i < level; ++i) each *= kOfABlock;
  return {block * each, std::min((block + 1) * each, positions_)};
}

}  // namespace lensd::optics
