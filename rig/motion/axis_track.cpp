// Judges only by readings and by what was commanded. Backlash counts as taken up only as far as readings show the axis
// went its way.
#include "rig/motion/axis_track.h"

#include <algorithm>
#include <cmath>

#include "rig/motion/leg.h"

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
  if (MakesNoSense(setup_, state.position)) return;
  const double scatter = Scatter();
  const double step = last_ ? std::abs((state.position - last_->position).value) : 0.0;
  if (state.moving || step > scatter) travel_ += step;
  if (!last_ || last_->position != state.position) {
    last_ = {.position = state.position, .changed = sampled_at};
  }
  last_->moving = state.moving;
  // Of an axis that ended its motion unseen, what it does next may still be that motion.
  if (ours || !rest_ || adrift_.by > 0.0) {
    rest_ = state.position;
  } else if (std::abs((state.position - *rest_).value) > scatter) {
    moved_by_ = {.us = false, .another = true};
    rest_ = state.position;
    slack_.Reset(sampled_at);
  }
  const bool seen = !ours && !state.moving && !state.assumed && adrift_.until == Until::SeenAtRest;
  const bool changed = step > scatter && !state.assumed && adrift_.until == Until::SeenToChange;
  if (seen || changed) adrift_.by = 0.0;
  slack_.Note(state.position, state.moving, sampled_at);
}

void AxisTrack::Commanded(Way way, Instant now) {
  moved_by_ = {.us = true, .another = false};
  arrived_ = false;
  if (last_) last_->changed = now;
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
  place_ = {};
  travel_ = doubt_ = 0.0;
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
  memory.known = place_.known;
  memory.offset = place_.offset;
  memory.said = place_.said;
  memory.slack = slack_.left();
  memory.travel = travel_;
  // Readings that ceased to change are asked for anew at the next start.
  memory.doubt = doubt_ + (adrift_.until == Until::SeenToChange ? 0.0 : adrift_.by);
  return memory;
}

double AxisTrack::Scatter() const {
  return std::max(setup_.tolerance, 2.0 * setup_.config.repeatability);
}

bool AxisTrack::Near(Native a, Native b) const {
  return std::abs((a - b).value) <= Scatter();
}

/// A motor that gets power is pulled to its next full step, and some controllers count that.
double AxisTrack::PowerUpScatter() const {
  constexpr double kSteps = 10.0, kOfRange = 0.02;
  if (!setup_.Counts()) return Scatter();
  const double range = (setup_.can.maximum - setup_.can.minimum).value;
  return std::max(Scatter(), std::min(kSteps * setup_.can.resolution, kOfRange * range));
}

bool AxisTrack::AtZero(Native device) const {
  return std::abs(device.value) <= PowerUpScatter();
}

bool AxisTrack::StandsAtZero(Native device, Native before) const {
  return AtZero(device) && Near(device, before);
}

/// The device counts on from where it stood.
bool AxisTrack::Stands(const AxisMemory& memory, Native device) const {
  return !memory.in_motion && Near(device + memory.offset, memory.position);
}

/// The axis stands at `position`, of which `memory` tells the rest.
void AxisTrack::Trust(const AxisMemory& memory, Native position) {
  place_.known = memory.known;
  place_.said = memory.said;
  travel_ = memory.travel;
  doubt_ = memory.doubt;
  slack_.Restore(memory.slack, position);
  last_ = Reading{.position = position};
  rest_ = position;
}

/// Of an axis that only counts: a device that was without power mostly counts from zero, some from where they last
/// saved their count, and nothing but the count tells. So it is believed where it stood at rest and says the same, and
/// at zero only where the configuration says that it has not moved without power.
void AxisTrack::TakeUp(const AxisMemory& memory, Native device) {
  const bool at_zero = AtZero(device);
  if (Stands(memory, device)) {
    place_.offset = memory.offset;
    Trust(memory, device + memory.offset);
    // It may have been that near to zero, and count from there anew.
    if (at_zero) doubt_ += std::abs((device + memory.offset - memory.position).value);
  } else if (at_zero && memory.known && !memory.in_motion && setup_.config.restore != Restore::Never) {
    place_.offset = memory.position - device;
    Trust(memory, memory.position);
    doubt_ += std::abs(device.value);
  } else {
    LoseCount();
  }
}

void AxisTrack::Recall(const AxisMemory& memory, const drivers::AxisState& state) {
  const Native device = state.position;
  arrived_ = !memory.in_motion;
  if (setup_.OnlyCounts()) return TakeUp(memory, device);
  if (setup_.Measures() && (memory.in_motion || !memory.known)) {
    // Only its readings can show where it stands.
    place_.offset = memory.offset;
    travel_ = memory.travel;
    return;
  }
  const bool at_zero = Near(device, {});
  const bool swept = device >= memory.lowest - Native{Scatter()} && device <= memory.highest + Native{Scatter()};
  const auto restore = [&] {
    place_.offset = memory.position - device;
    Trust(memory, memory.position);
  };
  const auto keep = [&](bool known) {
    if (!memory.in_motion && Near(device, memory.position)) return Trust(memory, device);
    place_.known = known;
  };
  // The device counts on from what was restored before.
  if (memory.offset != Native{} && Stands(memory, device)) {
    place_.offset = memory.offset;
    return Trust(memory, device + memory.offset);
  }
  switch (setup_.config.restore) {
    case Restore::Never:
      return keep(memory.known && !memory.in_motion);
    case Restore::Always:
      if (!memory.in_motion) return restore();
      // It is somewhere in what the motion may have swept.
      place_.known = memory.known;
      if (!swept) place_.offset = 0.5 * (memory.lowest + memory.highest) - device;
      travel_ = memory.travel;
      doubt_ = memory.doubt + (memory.highest - memory.lowest).value;
      return;
    case Restore::NearZero:
      if (at_zero && !memory.in_motion) return restore();
      return keep(memory.known && !memory.in_motion);
    case Restore::Conditional:
      if (memory.in_motion) {
        place_.known = memory.known && setup_.can.follows() && swept && !at_zero;
        travel_ = memory.travel;
        doubt_ = memory.doubt;
        return;
      }
      if (at_zero) return restore();
      return keep(false);
  }
}

/// A device that was without power counts from zero. One that is seen on its way, or at the end of it, has had power
/// all the time.
void AxisTrack::Return(const AxisMemory& before, std::optional<Native> target, const drivers::AxisState& state) {
  const Native device = state.position, position = device + place_.offset;
  const bool swept = position >= before.lowest - Native{Scatter()} && position <= before.highest + Native{Scatter()};
  const bool at_zero = AtZero(device);
  if (setup_.OnlyCounts()) {
    const bool went_on = before.in_motion && swept && !at_zero && (state.moving || (target && Near(position, *target)));
    if (!went_on) TakeUp(before, device);
    return;
  }
  if (!setup_.can.can_home || !setup_.can.follows()) return;
  const bool stands = !before.in_motion && Near(position, before.position);
  place_.known = before.known && (stands || (!at_zero && (swept || !before.in_motion)));
  if (!place_.known) Forget();
}

void AxisTrack::Forget() {
  place_.known = setup_.Measures();
  last_.reset();
  rest_.reset();
}

/// How fast a motor without a configured speed may get there is not known: one that was seen to crawl may just have
/// begun to turn.
bool AxisTrack::TooFast(Native here, Instant sampled_at) const {
  constexpr double kFaster = 2.0;  ///< than the configured speed
  constexpr double kRenewed =
      0.4;  ///< seconds; a register may be renewed that seldom, and then shows a long way at once
  if (!setup_.speed) return false;
  const std::chrono::duration<double> since = sampled_at - last_->changed;
  const double gone = std::abs((here - last_->position).value);
  return gone > kFaster * *setup_.speed * (since.count() + kRenewed) + 2.0 * Scatter();
}

bool AxisTrack::FellToZero(Native device, Instant sampled_at, const std::optional<Heading>& ours) const {
  if (!setup_.Counts() || !place_.known || !last_ || !AtZero(device)) return false;
  const Native zero = place_.offset, from = last_->position, here = zero + device;
  const double fallen = std::abs((from - here).value), least = 2.0 * Scatter();
  if (fallen <= least) return false;
  // Another program may have sent it there, and it was not seen on its way: that cannot be told from a loss of power.
  if (!ours) return !last_->moving;
  const Native target = ours->target;
  const Native room{slack_.whole() + least};
  if (here < std::min(from, target) - room || here > std::max(from, target) + room) return true;
  if (AtZero(from - zero)) return false;
  // A motion to another place may pass there, and does not stay.
  if (!AtZero(target - zero) && !Near(here, target)) return true;
  return ours->live && TooFast(here, sampled_at);
}

bool AxisTrack::Strays(Native device, Instant sampled_at, const std::optional<Heading>& ours,
                       const std::optional<AxisMemory>& swept) const {
  constexpr double kOvershoot = 0.02;  ///< of a motion: a servo may pass its target by so much
  if (!setup_.OnlyCounts() || !place_.known || !last_) return false;
  const Native here = device + place_.offset, from = last_->position;
  const double least = 2.0 * Scatter();
  if (std::abs((here - from).value) <= least) return false;
  const bool turns = swept && swept->in_motion;
  if (!ours && !turns) return !last_->moving || TooFast(here, sampled_at);
  const Native to = ours ? ours->target : from;
  Native lowest = std::min(from, to), highest = std::max(from, to);
  if (turns) {
    lowest = std::min(lowest, swept->lowest);
    highest = std::max(highest, swept->highest);
  }
  const Native room{slack_.whole() + least + kOvershoot * (highest - lowest).value};
  return here < lowest - room || here > highest + room || TooFast(here, sampled_at);
}

void AxisTrack::LoseCount() {
  Forget();
  TakenAway(false);
  if (setup_.OnlyCounts()) place_ = {.known = false, .said = false, .offset = {}};
}

void AxisTrack::Say(Native position, Native device) {
  place_ = {.known = true, .said = true, .offset = position - device};
  travel_ = doubt_ = 0.0;
  adrift_ = {};
  arrived_ = true;
  slack_.Restore(slack_.left(), position);
  last_ = Reading{.position = position};
  rest_ = position;
}

}  // namespace lensd::rig
