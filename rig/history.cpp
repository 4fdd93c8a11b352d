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

drivers::PerAxis<std::optional<LensedFrame::AxisDuring>> History::During(
    Instant begin, Instant end, const drivers::PerAxis<double>& tolerance) const {
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
      hull->moving |= state->moving || (hull->highest - hull->lowest).value > tolerance[axis];
    }
  }
  return during;
}

}  // namespace lensd::rig
