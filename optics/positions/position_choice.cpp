// Which positions of a lens a request admits.
#include <algorithm>
#include <cmath>

#include "optics/positions/focus_queue.h"
#include "optics/positions/position_blur.h"

namespace lensd::optics {

namespace {

/// The entries of rising `values` in [low, high], a rounding apart; where there are none, the one nearest to it.
template <class Value>
std::vector<std::size_t> Within(std::size_t count, const Value& value, double low, double high) {
  constexpr double kRounding = 1e-9;
  const double hair = kRounding * std::max(std::abs(low), std::abs(high));
  std::vector<std::size_t> inside;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (value(i) >= low - hair && value(i) <= high + hair) inside.push_back(i);
    const double middle = 0.5 * (low + high);
    if (std::abs(value(i) - middle) < std::abs(value(nearest) - middle)) nearest = i;
  }
  return inside.empty() ? std::vector{nearest} : inside;
}

/// As Within() does over the positions' extensions: blocks that lie inside or outside as a whole are not looked into.
class ExtensionsWithin {
 public:
  ExtensionsWithin(const LensPositions& lens, const FocusBlocks& blocks, double low, double high)
      : lens_(lens), blocks_(blocks), middle_(0.5 * (low + high)) {
    const double hair = 1e-9 * std::max(std::abs(low), std::abs(high));
    low_ = low - hair;
    high_ = high + hair;
  }

  IndexStretches Take() {
    for (std::size_t block = 0; block < blocks_.OfLevel(blocks_.levels()).size(); ++block) {
      AddBlock(blocks_.levels(), block);
    }
    if (inside_.empty()) AddNearest();
    return std::move(inside_);
  }

 private:
  double Extension(std::size_t position) const { return lens_.focus[position].extension.value; }

  void AddBlock(std::size_t level, std::size_t block) {
    const FocusRange& range = blocks_.OfLevel(level)[block];
    if (range.sound && (range.extension.high < low_ || range.extension.low > high_)) return;
    if (range.sound && range.extension.low >= low_ && range.extension.high <= high_) {
      const auto [first, end] = blocks_.PositionsOf(level, block);
      return inside_.Add(first, end);
    }
    const auto [first, end] = blocks_.PartsOf(level, block);
    for (std::size_t part = first; part < end; ++part) {
      if (level > 1) {
        AddBlock(level - 1, part);
      } else if (Extension(part) >= low_ && Extension(part) <= high_) {
        inside_.Add(part, part + 1);
      }
    }
  }

  void AddNearest() {
    IndexStretches all;
    all.Add(0, blocks_.positions());
    const auto of_block = [&](const FocusRange& range) {
      const double off = std::max({0.0, range.extension.low - middle_, middle_ - range.extension.high});
      return std::optional(FocusKey{off, 0.0});
    };
    const auto of_position = [&](std::size_t i) {
      return std::optional(FocusKey{std::abs(Extension(i) - middle_), 0.0});
    };
    FocusQueue queue(blocks_, all, of_block, of_position);
    const auto nearest = queue.Next();
    const std::size_t position = nearest ? nearest->position : 0;
    inside_.Add(position, position + 1);
  }

  const LensPositions& lens_;
  const FocusBlocks& blocks_;
  double middle_, low_ = 0.0, high_ = 0.0;
  IndexStretches inside_;
};

std::vector<std::size_t> Openings(const PlanRequest& request, const LensPositions& lens) {
  const auto n = [&](const Number& given) {
    return request.apertures_are_diameters ? lens.focal_length.value / given.value : given.value;
  };
  const auto f_number = [&](std::size_t j) { return lens.iris[j].f_number.value; };
  if (request.stops.empty()) {
    const auto [low, high] = std::minmax({n(request.f_numbers.low), n(request.f_numbers.high)});
    return Within(lens.iris.size(), f_number, low, high);
  }
  std::vector<std::size_t> chosen;
  for (const Number& stop : request.stops) {
    chosen.push_back(Within(lens.iris.size(), f_number, n(stop), n(stop)).front());
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace

PositionChoice ChoiceOf(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                        const PositionBlur& blur) {
  PositionChoice choice{.focus = {}, .iris = Openings(request, lens)};
  const auto& focus = lens.focus;
  if (!request.focus) {
    choice.focus = ExtensionsWithin(lens, blocks, request.extensions.low.value, request.extensions.high.value).Take();
    return choice;
  }
  const auto off = [&](std::size_t i) {
    return std::abs(blur.Vergence(*request.focus, focus[i]) - focus[i].focal_plane.value);
  };
  IndexStretches all;
  all.Add(0, focus.size());
  FocusQueue queue(
      blocks, all,
      [&](const FocusRange& range) { return std::optional(FocusKey{blur.LeastOff(*request.focus, range), 0.0}); },
      [&](std::size_t i) { return std::optional(FocusKey{off(i), 0.0}); });
  const auto found = queue.Next();
  const std::size_t nearest = found ? found->position : 0;
  choice.focus.Add(nearest, nearest + 1);
  double step = 0.0;
  if (nearest > 0) step = (focus[nearest].focal_plane - focus[nearest - 1].focal_plane).value;
  if (nearest + 1 < focus.size()) {
    step = std::max(step, (focus[nearest + 1].focal_plane - focus[nearest].focal_plane).value);
  }
  constexpr double kHalf = 0.5001;
  choice.focus_reachable =
      off(nearest) <= std::max(kHalf * step, blur.Bound(focus[nearest], focus[nearest].focal_plane.value));
  return choice;
}

}  // namespace lensd::optics
