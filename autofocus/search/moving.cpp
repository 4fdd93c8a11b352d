// Two states, on the way to the start of a pass and on the pass; what the pass saw is then judged as any other curve.
#include "autofocus/search/moving.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus {
namespace {

constexpr double kStridePx = 2.5;        ///< of blur, from frame to frame
constexpr double kBlindStrides = 150.0;  ///< over the range, where the optics are not known
constexpr double kHalfWay = 0.5;         ///< down from the top to the rest: so far the fit reaches
constexpr double kLeastStrides = 2.6;    ///< the fit reaches at least so far to both sides
constexpr double kPlacePx = 2.0;         ///< of blur: a frame whose place is less certain says nothing of the top
constexpr double kSparse = 2.0;          ///< strides between frames: farther apart calls for a slower pass
constexpr int kMostPasses = 3;
constexpr double kSlowest = 0.05;     ///< of the pass before
constexpr double kBlindPlace = 0.02;  ///< of the range: the same where the optics are not known

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

/// The widest distance between neighbouring frames within `reach` of the top.
double WidestGap(const std::vector<CurvePoint>& points, double top, double reach) {
  double widest = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double nearest = std::min(std::abs(points[i].position - top), std::abs(points[i - 1].position - top));
    if (nearest < reach) widest = std::max(widest, points[i].position - points[i - 1].position);
  }
  return widest;
}

}  // namespace

Moving::Moving(const Setup& setup) : setup_(setup), from_(setup.lowest), to_(setup.highest) {
  const double range = setup.highest - setup.lowest;
  const double usual = setup.blur_px ? kStridePx * *setup.blur_px : range / kBlindStrides;
  stride_ = std::max(setup.step.value_or(usual), setup.resolution);
  pace_ = std::min(stride_, *setup.stride);
  if (!setup.ascending) std::swap(from_, to_);
}

int Moving::FramesExpected() const {
  const int whole = static_cast<int>(std::ceil((setup_.highest - setup_.lowest) / std::min(stride_, *setup_.stride)));
  return std::max(whole, static_cast<int>(curve_.size())) + 2;
}

Advice Moving::Next(const Look& look) {
  if (!started_) {
    started_ = true;
    return GoAndLook{from_};
  }
  curve_.Add(look);
  if (!at_start_ || look.on_the_way) {
    at_start_ = true;
    return GoAndLook{to_, pace_};
  }
  return Conclude();
}

Advice Moving::Conclude() {
  const std::vector<CurvePoint> all = curve_.Points();
  const auto top = TopOf(all);
  if (!top) return Refuse(curve_.Overexposed() ? kTooBright : kNoPeak);
  const double place = all[top->index].position, sigma = all[top->index].position_sigma;
  const double certain = setup_.blur_px ? kPlacePx * *setup_.blur_px : kBlindPlace * (setup_.highest - setup_.lowest);
  const double gap = WidestGap(all, place, kLeastStrides * stride_);
  const bool known = sigma <= certain;
  if ((!known || gap > kSparse * stride_) && passes_ < kMostPasses) {
    // Frames come more rarely, or readings farther apart, than the camera and the lens let expect.
    ++passes_;
    at_start_ = false;
    const double around = std::max({2.0 * gap, 3.0 * sigma, 4.0 * stride_});
    const double sign = setup_.ascending ? 1.0 : -1.0;
    from_ = std::clamp(place - sign * around, setup_.lowest, setup_.highest);
    to_ = std::clamp(place + sign * around, setup_.lowest, setup_.highest);
    pace_ *= std::clamp(stride_ / std::max(gap, 2.0 * sigma), kSlowest, 0.5);
    return GoAndLook{from_};
  }
  if (!known) {
    return Refuse({Cause::PlaceUnknown,
                   "the lens' place is not known well enough where it is sharpest: backlash not yet taken up, or "
                   "readings too rare"});
  }
  const double step = std::max(gap, stride_);
  return JudgePeak(setup_, curve_, all, *top, std::max(HalfWidth(all, *top), kLeastStrides * step), step);
}

}  // namespace lensd::autofocus
