// Recent readings by axis, so that a frame can be told where the lens was while it was exposed and how surely.
#include "history.h"

#include <algorithm>

namespace lensd::rig {
namespace {

constexpr Duration kKept = std::chrono::seconds(10);

bool SameAxes(const drivers::LensState& a, const drivers::LensState& b) {
  return std::ranges::all_of(drivers::kAxes, [&](drivers::Axis axis) {
    const auto& one = a.axes[axis];
    const auto& other = b.axes[axis];
    if (!one || !other) return one.has_value() == other.has_value();
    return one->position == other->position && one->moving == other->moving;
  });
}

}  // namespace

void History::Add(const drivers::LensState& state) {
  if (!readings_.empty() && state.sampled_at <= readings_.back().sampled_at) return;
  // Standing still needs no more than its first and its last reading.
  const std::size_t count = readings_.size();
  if (count >= 2 && SameAxes(readings_[count - 1], state) && SameAxes(readings_[count - 2], state)) {
    readings_.back() = state;
    return;
  }
  readings_.push_back(state);
  while (readings_.front().sampled_at < state.sampled_at - kKept && readings_.size() > 2) readings_.pop_front();
}

drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> History::During(Instant begin, Instant end) const {
  drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> during;
  if (readings_.empty()) return during;
  const auto sampled = [](const drivers::LensState& reading) { return reading.sampled_at; };
  auto first = std::ranges::upper_bound(readings_, begin, {}, sampled);
  if (first != readings_.begin()) --first;
  auto last = std::ranges::lower_bound(readings_, end, {}, sampled);
  const bool covered = first->sampled_at <= begin && last != readings_.end();
  if (last != readings_.end()) ++last;
  for (const drivers::Axis axis : drivers::kAxes) {
    for (auto reading = first; reading != last; ++reading) {
      const auto& state = reading->axes[axis];
      if (!state) continue;
      auto& hull = during[axis];
      if (!hull) hull = LensedFrame::AxisDuring{state->position, state->position, !covered};
      hull->lowest = std::min(hull->lowest, state->position);
      hull->highest = std::max(hull->highest, state->position);
      hull->moving |= state->moving || (hull->highest - hull->lowest).value > tolerance_[axis];
    }
    if (during[axis]) during[axis] = AtMid(*during[axis], axis, begin + (end - begin) / 2);
  }
  return during;
}

/// Between two readings the axis was between the two places.
LensedFrame::AxisDuring History::AtMid(LensedFrame::AxisDuring hull, drivers::Axis axis, Instant mid) const {
  hull.mid = 0.5 * (hull.lowest + hull.highest);
  hull.mid_bound = 0.5 * (hull.highest - hull.lowest);
  const auto after = std::ranges::lower_bound(readings_, mid, {},
                                              [](const drivers::LensState& reading) { return reading.sampled_at; });
  if (after == readings_.begin() || after == readings_.end()) return hull;
  const auto before = std::prev(after);
  const auto& one = before->axes[axis];
  const auto& other = after->axes[axis];
  if (!one || !other) return hull;
  const auto seconds = [](Duration duration) { return std::chrono::duration<double>(duration).count(); };
  const double part = seconds(mid - before->sampled_at) / seconds(after->sampled_at - before->sampled_at);
  hull.mid = one->position + part * (other->position - one->position);
  const Native most = std::max(hull.mid - std::min(one->position, other->position),
                               std::max(one->position, other->position) - hull.mid);
  hull.mid_bound = most;
  return hull;
}

}  // namespace lensd::rig
