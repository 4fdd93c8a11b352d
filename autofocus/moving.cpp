#include "moving.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus {
namespace {

constexpr double kStridePx = 2.5;        ///< of blur, from frame to frame
constexpr double kBlindStrides = 150.0;  ///< over the range, where the optics are not known
constexpr double kHalfWay = 0.5;         ///< down from the top to the rest: so far the fit reaches
constexpr double kLeastStrides = 2.6;    ///< the fit reaches at least so far to both sides
constexpr double kPlacePx = 2.0;         ///< of blur: a frame whose place is less certain says nothing of the top
constexpr double kBlindPlace = 0.02;     ///< of the range: the same where the optics are not known

/// How far from the top the curve has come half way down, on the steeper side.
double HalfWidth(const std::vector<CurvePoint>& points, const CurveTop& top) {
  const double level = top.rest + kHalfWay * (points[top.index].value - top.rest);
  const auto first = points.begin() + static_cast<std::ptrdiff_t>(top.index);
  const auto below = [&](const CurvePoint& point) { return point.value < level; };
  const auto right = std::find_if(first, points.end(), below);
  const auto left = std::find_if(std::make_reverse_iterator(first), points.rend(), below);
  const double place = points[top.index].position;
  const double whole = points.back().position - points.front().position;
  const double to_right = right == points.end() ? whole : right->position - place;
  const double to_left = left == points.rend() ? whole : place - left->position;
  return std::min(to_left, to_right);
}

}  // namespace

Moving::Moving(const Setup& setup) : setup_(setup) {
  const double range = setup.highest - setup.lowest;
  const double wanted = setup.blur_px ? kStridePx * *setup.blur_px : range / kBlindStrides;
  stride_ = std::min(std::max(wanted, setup.resolution), *setup.stride);
}

int Moving::FramesExpected() const {
  const int whole = static_cast<int>(std::ceil((setup_.highest - setup_.lowest) / stride_));
  return std::max(whole, static_cast<int>(curve_.size())) + 2;
}

Advice Moving::Next(const Look& look) {
  const double start = setup_.ascending ? setup_.lowest : setup_.highest;
  const double end = setup_.ascending ? setup_.highest : setup_.lowest;
  if (!started_) {
    started_ = true;
    curve_.SetFrame(look);
    return GoAndLook{start};
  }
  curve_.Add(look);
  if (!at_start_ || look.on_the_way) {
    at_start_ = true;
    return GoAndLook{end, stride_};
  }
  return Conclude();
}

Advice Moving::Conclude() const {
  const std::vector<CurvePoint> all = curve_.Points();
  const auto top = TopOf(all);
  if (!top) return Refuse(kNoPeak);
  const double certain = setup_.blur_px ? kPlacePx * *setup_.blur_px : kBlindPlace * (setup_.highest - setup_.lowest);
  if (all[top->index].position_sigma > certain) {
    return Refuse("sharpest where the backlash was not yet taken up: there the lens' place in motion is not known");
  }
  // The frames need not come at even distances; a lens may be slower than it says, and frames are lost.
  double widest = stride_;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double middle = 0.5 * (all[i].position + all[i - 1].position);
    const double gap = all[i].position - all[i - 1].position;
    if (std::abs(middle - all[top->index].position) < kLeastStrides * stride_) widest = std::max(widest, gap);
  }
  const double reach = std::max(HalfWidth(all, *top), kLeastStrides * widest);
  return JudgePeak(setup_, curve_, all, *top, reach, widest);
}

}  // namespace lensd::autofocus
