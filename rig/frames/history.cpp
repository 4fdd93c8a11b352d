// Recent readings by axis, so that a frame can be told where the lens was while it was exposed and how surely.
#include "rig/frames/history.h"

#include <algorithm>

namespace lensd::rig {
namespace {

constexpr Duration kKept = std::chrono::seconds(10);
constexpr std::size_t kForgottenAtOnce = 256;

}  // namespace

History::Reading History::ReadingOf(const drivers::LensState& state) {
  Reading reading{state.sampled_at, {}};
  for (const drivers::Axis axis : drivers::kAxes) {
    if (const auto& one = state.axes[axis]) reading.axes[axis] = {one->position, true, one->moving};
  }
  return reading;
}

bool History::SameAxes(const Reading& a, const Reading& b) {
  return std::ranges::all_of(drivers::kAxes, [&](drivers::Axis axis) { return a.axes[axis] == b.axes[axis]; });
}

void History::Add(const drivers::LensState& state) {
  if (!readings_.empty() && state.sampled_at <= readings_.back().sampled_at) return;
  const Reading reading = ReadingOf(state);
  // Standing still needs no more than its first and its last reading.
  const auto known = kept();
  if (known.size() >= 2 && SameAxes(known.back(), reading) && SameAxes(known[known.size() - 2], reading)) {
    readings_.back() = reading;
    return;
  }
  readings_.push_back(reading);
  while (readings_[past_].sampled_at < reading.sampled_at - kKept && kept().size() > 2) ++past_;
  if (past_ < kForgottenAtOnce) return;
  readings_.erase(readings_.begin(), readings_.begin() + static_cast<std::ptrdiff_t>(past_));
  past_ = 0;
}

void History::Clear() {
  readings_.clear();
  past_ = 0;
}

drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> History::During(Instant begin, Instant end) const {
  drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> during;
  const auto readings = kept();
  if (readings.empty()) return during;
  auto first = std::ranges::upper_bound(readings, begin, {}, &Reading::sampled_at);
  if (first != readings.begin()) --first;
  auto last = std::ranges::lower_bound(readings, end, {}, &Reading::sampled_at);
  const bool covered = first->sampled_at <= begin && last != readings.end();
  if (last != readings.end()) ++last;
  for (const drivers::Axis axis : drivers::kAxes) {
    for (auto reading = first; reading != last; ++reading) {
      const Place& place = reading->axes[axis];
      if (!place.known) continue;
      auto& hull = during[axis];
      if (!hull) hull = LensedFrame::AxisDuring{place.position, place.position, !covered};
      hull->lowest = std::min(hull->lowest, place.position);
      hull->highest = std::max(hull->highest, place.position);
      hull->moving |= place.moving || (hull->highest - hull->lowest).value > tolerance_[axis];
    }
    if (during[axis]) during[axis] = AtMid(*during[axis], axis, begin + (end - begin) / 2);
  }
  return during;
}

/// Between two readings the axis was between the two places.
LensedFrame::AxisDuring History::AtMid(LensedFrame::AxisDuring hull, drivers::Axis axis, Instant mid) const {
  hull.mid = 0.5 * (hull.lowest + hull.highest);
  hull.mid_bound = 0.5 * (hull.highest - hull.lowest);
  const auto readings = kept();
  const auto after = std::ranges::lower_bound(readings, mid, {}, &Reading::sampled_at);
  if (after == readings.begin() || after == readings.end()) return hull;
  const auto before = std::prev(after);
  const Place& one = before->axes[axis];
  const Place& other = after->axes[axis];
  if (!one.known || !other.known) return hull;
  const auto seconds = [](Duration duration) { return std::chrono::duration<double>(duration).count(); };
  const double part = seconds(mid - before->sampled_at) / seconds(after->sampled_at - before->sampled_at);
  hull.mid = one.position + part * (other.position - one.position);
  const Native most =
      std::max(hull.mid - std::min(one.position, other.position), std::max(one.position, other.position) - hull.mid);
  hull.mid_bound = most;
  return hull;
}

}  // namespace lensd::rig
