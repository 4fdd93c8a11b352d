// Judges only by readings and by what was commanded. Backlash counts as taken up only as far as readings show the axis
// went its way.
#include "axis_track.h"

#include <algorithm>
#include <cmath>

#include "leg.h"

namespace lensd::rig {

BacklashState::BacklashState(double backlash, double noise, bool upward)
    : backlash_(backlash),
      whole_(backlash > 0.0 ? backlash + 2.0 * noise : 0.0),
      reversal_(2.0 * noise),
      sign_(upward ? 1.0 : -1.0) {}

void BacklashState::Reset(Instant since) {
  since_ = since;
  begun_ = false;
}

void BacklashState::Note(Native position, bool moving, Instant sampled_at) {
  const double place = sign_ * position.value;
  if (!begun_) anchor_ = peak_ = place;
  begun_ = true;
  if (since_) {
    anchor_ = peak_ = place;
    if (!moving && sampled_at > *since_) since_.reset();
    return;
  }
  // Going back by more than the readings scatter puts all of it back, and so does a new lowest place.
  if (place < peak_ - reversal_ || place < anchor_) anchor_ = peak_ = place;
  peak_ = std::max(peak_, place);
}

double BacklashState::left() const {
  if (!begun_) return whole_;
  return std::max(0.0, whole_ - (peak_ - anchor_));
}

double BacklashState::residue() const {
  return std::min(backlash_, left());
}

void BacklashState::Restore(double left, Native position) {
  since_.reset();
  begun_ = true;
  peak_ = sign_ * position.value;
  anchor_ = peak_ - std::max(0.0, whole_ - left);
}

AxisTrack::AxisTrack(const AxisSetup& setup)
    : setup_(setup), slack_(setup.backlash, setup.config.repeatability, setup.approach_up) {}

void AxisTrack::BacklashChanged() {
  slack_ = BacklashState(setup_.backlash, setup_.config.repeatability, setup_.approach_up);
}

void AxisTrack::Note(const drivers::AxisState& state, Instant sampled_at, bool ours) {
  const double scatter = std::max(setup_.tolerance, 2.0 * setup_.config.repeatability);
  const double step = last_ ? std::abs((state.position - *last_).value) : 0.0;
  if (state.moving || step > scatter) travel_ += step;
  last_ = state.position;
  // Of an axis that ended its motion unseen, what it does next may still be that motion.
  if (ours || !rest_ || adrift_.by > 0.0 || MakesNoSense(setup_, state.position)) {
    rest_ = state.position;
  } else if (std::abs((state.position - *rest_).value) > scatter) {
    moved_by_another_ = true;
    moved_by_us_ = false;
    rest_ = state.position;
    slack_.Reset(sampled_at);
  }
  const bool seen = !ours && !state.moving && !state.assumed && adrift_.until == Until::SeenAtRest;
  const bool changed = step > scatter && !state.assumed && adrift_.until == Until::SeenToChange;
  if (seen || changed) adrift_.by = 0.0;
  slack_.Note(state.position, state.moving, sampled_at);
}

void AxisTrack::Commanded(Way way, Instant now) {
  moved_by_us_ = true;
  arrived_ = false;
  moved_by_another_ = false;
  // Where a motion turns between two readings is not seen; it is no more than one polling period of travel.
  travel_ += setup_.can.resolution;
  if (way == Way::MayTurn) slack_.Reset(now);
}

void AxisTrack::Arrived() {
  arrived_ = true;
  adrift_.by = 0.0;
}

void AxisTrack::Homed(Instant now) {
  Arrived();
  known_ = true;
  travel_ = doubt_ = 0.0;
  offset_ = {};
  slack_.Reset(now);
}

double AxisTrack::Bound() const {
  double bound = 0.5 * setup_.can.resolution + setup_.config.repeatability + slack_.residue() + doubt_ +
                 setup_.lost_travel * travel_;
  if (!setup_.can.follows()) bound += setup_.config.sag.value_or(setup_.tolerance);
  return bound;
}

Arrival AxisTrack::NextArrival(Native position) const {
  return {.position = position,
          .minimum = setup_.minimum,
          .maximum = setup_.maximum,
          .upward = setup_.approach_up,
          .overshoots = setup_.TakesUp(),
          .backlash = slack_.whole(),
          .not_taken_up = slack_.left(),
          // Each command may turn between two readings: see Commanded().
          .rest = Bound() - slack_.residue() + setup_.lost_travel * 2.0 * setup_.can.resolution,
          .lost_travel = setup_.lost_travel};
}

/// As AxisMotion arrives: straight where the travel takes up the backlash, else from beyond as far as the soft limits
/// leave room.
Native Arrival::BoundAt(Native target) const {
  const double sign = upward ? 1.0 : -1.0;
  const double ahead = sign * (target - position).value;
  double left = ahead >= 0.0 ? std::max(0.0, not_taken_up - ahead) : backlash;
  double travel = std::abs(ahead);
  if (left > 0.0 && overshoots) {
    const Native from = std::clamp(target - Native{sign * backlash}, minimum, maximum);
    if (from != position) left = std::max(0.0, backlash - std::abs((target - from).value));
    travel += 2.0 * backlash;
  }
  return Native{rest + left + lost_travel * travel};
}

AxisMemory AxisTrack::Remember(Native position) const {
  AxisMemory memory;
  memory.position = memory.lowest = memory.highest = position;
  memory.known = known_;
  memory.slack = slack_.left();
  memory.travel = travel_;
  // Readings that ceased to change are asked for anew at the next start.
  memory.doubt = doubt_ + (adrift_.until == Until::SeenToChange ? 0.0 : adrift_.by);
  return memory;
}

/// The axis stands at `position`, of which `memory` tells the rest.
void AxisTrack::Trust(const AxisMemory& memory, Native position) {
  known_ = memory.known;
  travel_ = memory.travel;
  doubt_ = memory.doubt;
  slack_.Restore(memory.slack, position);
  last_ = rest_ = position;
}

void AxisTrack::Recall(const AxisMemory& memory, const drivers::AxisState& state) {
  const Native device = state.position;
  arrived_ = !memory.in_motion;
  const double scatter = std::max(setup_.tolerance, 2.0 * setup_.config.repeatability);
  const auto near = [&](Native a, Native b) { return std::abs((a - b).value) <= scatter; };
  const bool at_zero = near(device, {});
  const bool swept = device >= memory.lowest - Native{scatter} && device <= memory.highest + Native{scatter};
  const auto restore = [&] {
    offset_ = memory.position - device;
    Trust(memory, memory.position);
  };
  const auto keep = [&](bool known) {
    if (!memory.in_motion && near(device, memory.position)) return Trust(memory, device);
    known_ = known;
  };
  switch (setup_.config.restore) {
    case Restore::Never:
      return keep(memory.known && !memory.in_motion);
    case Restore::Always:
      if (!memory.in_motion) return restore();
      // It is somewhere in what the motion may have swept.
      known_ = memory.known;
      if (!swept) offset_ = 0.5 * (memory.lowest + memory.highest) - device;
      travel_ = memory.travel;
      doubt_ = memory.doubt + (memory.highest - memory.lowest).value;
      return;
    case Restore::NearZero:
      if (at_zero && !memory.in_motion) return restore();
      return keep(memory.known && !memory.in_motion);
    case Restore::Conditional:
      if (memory.in_motion) {
        known_ = memory.known && setup_.can.follows() && swept && !at_zero;
        travel_ = memory.travel;
        doubt_ = memory.doubt;
        return;
      }
      if (at_zero) return restore();
      return keep(false);
  }
}

/// A device that was without power counts from zero.
void AxisTrack::Return(const AxisMemory& before, Native position) {
  if (!setup_.can.can_home || !setup_.can.follows()) return;
  const double scatter = std::max(setup_.tolerance, 2.0 * setup_.config.repeatability);
  const bool stands = !before.in_motion && std::abs((position - before.position).value) <= scatter;
  const bool swept = position >= before.lowest - Native{scatter} && position <= before.highest + Native{scatter};
  const bool at_zero = std::abs((position - offset_).value) <= scatter;
  known_ = before.known && (stands || (!at_zero && (swept || !before.in_motion)));
}

}  // namespace lensd::rig
