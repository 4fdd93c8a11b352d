// A place is told from another by where the axes were sent. Readings alone would not do: an encoder's last digit may
// change by itself, while a step that was asked for is meant, however small it is.
#include "daemon/lens/state_history.h"

#include <cmath>
#include <utility>

namespace lensd::daemon {

std::optional<StateHistory::Place> StateHistory::PlaceOf(const rig::Rig& rig) {
  auto state = rig::TakePreset(rig, "before");
  if (!state) return std::nullopt;
  Place place{.state = *std::move(state), .sent = {}, .slack = {}, .given = rig.commands_given({}).given};
  const rig::Status status = rig.GetStatus();
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto& now = status.axes[axis];
    if (!now) continue;
    if (now->moved_by_us) place.sent[axis] = now->target;
    place.slack[axis] = now->bound + Native{rig.lens().axes[axis]->resolution};
  }
  return place;
}

bool StateHistory::Same(const Place& one, const Place& other) {
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto &here = one.state.native[axis], &there = other.state.native[axis];
    if (here.has_value() != there.has_value() || one.sent[axis] != other.sent[axis]) return false;
    if (here && std::abs((*here - *there).value) > (*one.slack[axis] + *other.slack[axis]).value) return false;
  }
  return true;
}

void StateHistory::Note(const rig::Rig& rig) {
  auto here = PlaceOf(rig);
  if (!here) return;
  const std::lock_guard lock(mutex_);
  if (!places_.empty() && Same(*here, places_.back())) return;
  // From there to here another program has moved it, and not the command before which that place was noted.
  if (!places_.empty() && places_.back().given == here->given) places_.pop_back();
  places_.push_back(*std::move(here));
  if (places_.size() > kMostPlaces) places_.pop_front();
}

void StateHistory::Disown(const rig::Rig& rig) {
  const std::lock_guard lock(mutex_);
  if (!places_.empty() && places_.back().given == rig.commands_given({}).given) places_.pop_back();
}

void StateHistory::Clear() {
  const std::lock_guard lock(mutex_);
  places_.clear();
}

std::optional<rig::Preset> StateHistory::Before(const rig::Rig& rig) const {
  const auto here = PlaceOf(rig);
  const std::lock_guard lock(mutex_);
  const bool noted = here && !places_.empty() && Same(*here, places_.back());
  const std::size_t before = noted ? 1 : 0;
  if (places_.size() <= before) return std::nullopt;
  return places_[places_.size() - 1 - before].state;
}

}  // namespace lensd::daemon
