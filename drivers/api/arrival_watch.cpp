// Every reading is compared with the one before and with the command; what a register showed and then took back speaks
// against it for long.
#include "drivers/api/arrival_watch.h"

#include <algorithm>
#include <cmath>

namespace lensd::drivers {
namespace {

using std::chrono::milliseconds;

constexpr int kShowsMotion = 3;                     ///< readings in a row, each nearer: one or two may be false answers
constexpr int kShowsBusy = 2;                       ///< readings in a row, for the same reason
constexpr int kTrusted = 4;                         ///< moves in a row
constexpr int kDistrust = -60;                      ///< after a reading that was taken back
constexpr double kOvershoot = 0.02;                 ///< of a move: a servo may pass its target by so much
constexpr Duration kStill = milliseconds(600);      ///< a position that does not change for so long rests
constexpr Duration kCreeps = milliseconds(400);     ///< unless it still changes, by however little
constexpr Duration kTrembles = milliseconds(2000);  ///< and not for longer than this
constexpr Duration kBusyStill = milliseconds(100);  ///< where the device has said that it moved, and says so no more
constexpr double kSlower = 2.0;                     ///< than so far, a motor may be on the rest of its way
constexpr Duration kAgree = milliseconds(50);       ///< two readings of a place where the axis may have turned
constexpr Duration kAgreeBeside = milliseconds(150);  ///< two readings of a place beside the target

}  // namespace

bool ArrivalWatch::Near(Native a, Native b) const {
  return std::abs((a - b).value) <= near_;
}

bool ArrivalWatch::trusted() const {
  return trust_ >= kTrusted;
}

void ArrivalWatch::Sent(Native target, Instant now) {
  Motion next;
  next.under_way = true;
  next.began = next.written_at = next.differed_at = now;
  next.target = next.written = target;
  // A target farther the same way leaves what was seen so far in force; any other may have the axis turn.
  const auto way = [](Native a, Native b) { return (a - b).value; };
  const bool onward = motion_.under_way && motion_.from && motion_.target &&
                      way(*motion_.target, *motion_.from) * way(target, *motion_.target) >= 0.0;
  if (!motion_.under_way && !last_busy_) next.from = places_.rested ? places_.rested : last_;
  if (onward) {
    next.from = motion_.from;
    next.onward = true;
    next.readings = motion_.readings;
    next.busy_first = motion_.busy_first;
  }
  if (next.from) next.nearest = std::abs(way(target, *next.from));
  motion_ = next;
}

void ArrivalWatch::Homing(Instant now) {
  motion_ = {};
  motion_.under_way = true;
  motion_.began = now;
}

/// What stands, and is not about to begin, needs no proof of that. A register may echo the target after this write too.
void ArrivalWatch::Stopped(Instant now) {
  if (!motion_.under_way && !last_busy_) return;
  motion_.under_way = true;
  motion_.began = motion_.written_at = now;
  motion_.target.reset();
  motion_.from.reset();
  motion_.there_since.reset();
  motion_.first.reset();
  motion_.last.reset();
  motion_.live = motion_.between = false;
}

bool ArrivalWatch::moved() const {
  if (seen() || !last_) return seen();
  if (!motion_.from) return changed_at_ > motion_.began;
  return !Near(*last_, *motion_.from) && (!motion_.target || !Near(*last_, *motion_.target));
}

ArrivalWatch::Verdict ArrivalWatch::Judge(Native position, bool busy, Instant now) {
  Note(position, busy, now);
  if (!motion_.under_way) return {.moving = busy, .echo = false};
  if (Rests(position, busy, now)) {
    places_.rested = places_.live = places_.agreed = position;
    Arrive(now);
    return {};
  }
  const bool echo = by_ == Shows::Position && motion_.written && !motion_.live && !trusted() &&
                    Near(position, *motion_.written) && now < motion_.written_at + lag_;
  if (!echo) {
    if (places_.live && Near(position, *places_.live)) places_.agreed = position;
    places_.live = position;
    return {.moving = true, .echo = false};
  }
  return {.moving = true,
          .echo = true,
          .instead = motion_.last   ? std::optional(motion_.last->position)
                     : motion_.from ? motion_.from
                                    : places_.agreed};
}

void ArrivalWatch::Note(Native position, bool busy, Instant now) {
  const bool changed = !last_ || !Near(position, anchor_);
  const bool before_busy = last_busy_, first = motion_.readings == 0;
  if (changed) {
    anchor_ = position;
    changed_at_ = now;
  }
  // One reading alone may be wrong.
  if (!motion_.under_way && !busy && last_ && Near(position, *last_)) places_.rested = position;
  if (last_ != position) {
    if (motion_.differed_at > motion_.began) motion_.between_changes = now - motion_.differed_at;
    motion_.differed_at = now;
  }
  last_ = position;
  last_busy_ = busy;
  motion_.busy_readings = busy ? motion_.busy_readings + 1 : 0;
  motion_.busy_seen = motion_.busy_seen || motion_.busy_readings >= kShowsBusy;
  ++motion_.readings;
  if (first) motion_.busy_first = busy;
  if (!motion_.target) return;
  if (!Near(position, *motion_.target)) {
    motion_.there_since.reset();
  } else if (!motion_.there_since) {
    motion_.there_since = now;
  }
  if (motion_.under_way) Follow(position, now);
  if (now > motion_.began + 2 * lag_) return;
  const bool there = Near(position, *motion_.target);
  const double way = motion_.from ? std::abs((*motion_.target - *motion_.from).value) : 0.0;
  const double away = std::abs((*motion_.target - position).value);
  const bool left = motion_.there && away > std::max(2.0 * near_, kOvershoot * way);
  // What moves without saying so, or was at its target and is not, shows that the registers are not to be believed.
  const bool unsaid = !first && changed && !busy && !before_busy && away > std::max(2.0 * near_, kOvershoot * way);
  if (left || unsaid) {
    motion_.contradicted = true;
    trust_ = kDistrust;
  }
  motion_.there = motion_.there || there;
}

/// Whether readings come nearer, one after the other, somewhere between the start and the target.
void ArrivalWatch::Follow(Native position, Instant now) {
  if (!motion_.from) return;
  const double to_go = std::abs((*motion_.target - position).value);
  const double gone = std::abs((position - *motion_.from).value);
  const bool between =
      to_go > near_ && gone > near_ && to_go + gone <= std::abs((*motion_.target - *motion_.from).value) + near_;
  if (between) {
    motion_.last = PlaceOnTheWay{position, to_go, now};
    if (!motion_.first) motion_.first = motion_.last;
  }
  if (motion_.live) return;
  if (!between || to_go > motion_.nearest + near_) {
    motion_.on_the_way = 0;
    if (between) motion_.nearest = to_go;
    return;
  }
  if (to_go > motion_.nearest - near_) return;
  motion_.nearest = to_go;
  motion_.live = ++motion_.on_the_way >= kShowsMotion;
  // Of a motion that goes on, one such place may be that of the second command, and stale.
  motion_.between = motion_.between || motion_.on_the_way > (motion_.onward ? 1 : 0);
}

/// The least speed that readings on the way have shown, units a second; 0: they show none.
double ArrivalWatch::Pace() const {
  if (!motion_.last) return 0.0;
  const auto per_second = [&](double way, Instant since) {
    const std::chrono::duration<double> took = motion_.last->at - since;
    return took.count() > 0.0 ? way / took.count() : 0.0;
  };
  const double gone = std::abs((*motion_.target - *motion_.from).value) - motion_.last->to_go;
  const double seen = motion_.first->to_go - motion_.last->to_go - near_;  // either may be rounded
  return std::max({0.0, motion_.onward ? 0.0 : per_second(gone, motion_.began), per_second(seen, motion_.first->at)});
}

/// Of an axis that is read at its target: whether it has had the time to come there from where it was last read, or has
/// been read there for so long that this is no echo.
bool ArrivalWatch::MayBeThere(Instant now) const {
  if (now >= *motion_.there_since + lag_) return true;
  const double pace = Pace();
  if (pace <= 0.0) return false;
  const std::chrono::duration<double> since = now - motion_.last->at;
  return since.count() * pace >= (trusted() ? 1.0 : kSlower) * motion_.last->to_go;
}

bool ArrivalWatch::Rests(Native position, bool busy, Instant now) const {
  if (busy) return false;
  const bool there = motion_.target && Near(position, *motion_.target);
  // One reading on the way is as good where "busy" speaks for it.
  const bool shown = motion_.live || (motion_.between && motion_.busy_seen);
  if (there && shown && MayBeThere(now)) return Agrees(position, now);
  if (there && by_ == Shows::Busy && motion_.busy_seen) return true;
  if (now < motion_.began + lag_) {
    const bool may_be_stale = motion_.from && Near(position, *motion_.from) && position != motion_.target;
    if (!trusted() || !there || may_be_stale) return false;
    if (motion_.busy_seen) return (!motion_.last || MayBeThere(now)) && Agrees(position, now);
    // So short a way may have been gone between two readings.
    const std::chrono::duration<double> since = now - motion_.began;
    return motion_.from && Exact(position) &&
           std::abs((*motion_.target - *motion_.from).value) <= pace_ * since.count();
  }
  // What is read there since registers say what is has to be read there twice.
  const bool late = there && *motion_.there_since >= motion_.began + lag_;
  if (there) return (late ? now > *motion_.there_since : MayBeThere(now)) && Agrees(position, now);
  if (motion_.busy_seen && !motion_.target) return now >= changed_at_ + kBusyStill;
  // What creeps from one place to the next does not rest; what trembles between two does.
  const bool creeps = now < motion_.differed_at + kCreeps && now < changed_at_ + kTrembles;
  return now >= changed_at_ + kStill && !creeps;
}

bool ArrivalWatch::Exact(Native position) const {
  return motion_.target && std::abs((position - *motion_.target).value) <= 0.25 * near_;
}

/// Where a reading is the target itself, and nothing else was on the way, the axis is there. Beside it, or where it may
/// have turned, it must not have changed for longer than it took from one place to the next.
bool ArrivalWatch::Agrees(Native position, Instant now) const {
  const bool exact = Exact(position);
  if (exact && (motion_.from || (trusted() && motion_.busy_seen))) return true;
  const Duration between = motion_.between_changes > Duration::zero() ? 2 * motion_.between_changes : kStill;
  const Duration still = exact ? kAgree : std::clamp(between, kAgreeBeside, kStill);
  return now >= motion_.differed_at + still || now >= std::max(changed_at_, motion_.began) + kTrembles;
}

void ArrivalWatch::Arrive(Instant now) {
  motion_.under_way = false;
  // Seen on its way until it arrived, and "busy" all the while.
  const bool proven = motion_.target && motion_.between && motion_.busy_seen && motion_.busy_first && motion_.there &&
                      !motion_.contradicted;
  if (!proven) return;
  ++trust_;
  const std::chrono::duration<double> took = now - motion_.began;
  const double pace = std::abs((*motion_.target - *motion_.from).value) / took.count();
  pace_ = pace_ > 0.0 ? std::min(pace_, pace) : pace;
}

}  // namespace lensd::drivers
