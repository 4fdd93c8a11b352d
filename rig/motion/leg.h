// One leg of a motion: from where the axis stands straight to one place.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/api/arrival_watch.h"
#include "drivers/api/lens.h"
#include "rig/motion.h"
#include "rig/motion/axis_setup.h"

namespace lensd::rig {

/// Readings of one place differ by up to this.
double Scatter(const AxisSetup& setup);
/// No axis stands where this reading says, so far is it from all that the axis may reach.
bool MakesNoSense(const AxisSetup& setup, Native position);
/// What is to be said of such a reading.
std::string SenselessText(const AxisSetup& setup, Native position);

/// Readings that may show that an axis is led away from its target.
struct AwayWatch {
  std::optional<Instant> since = {};
  double from = 0.0;  ///< so far from the target, by the first of them
  double pace = 0.0;  ///< native units a second that it has come nearer before; 0: not known
};

/// When each of its commands is due, how long it may take, and what its readings say. It commands nothing itself.
class Leg {
 public:
  enum class Start { Onward, MayTurn };
  /// `setup` must outlive it. `parts`: how it is divided; empty: not at all. `start`: the axis may have to turn first.
  Leg(const AxisSetup& setup, Native from, Native to, std::vector<Impulse> parts, Start start);
  /// One that needs no command: the axis stays at `place`.
  static Leg Stay(const AxisSetup& setup, Native place, Instant now);
  /// One that has begun where that reading says and ends at the reference, wherever that is.
  static Leg Homing(const AxisSetup& setup, const drivers::AxisState& from, Instant now);

  Native to() const { return to_; }
  Instant commanded_at() const { return times_.commanded_at; }
  bool late(Instant now) const { return now > times_.deadline; }
  bool begun() const { return sent_ > 0; }

  /// A command that is due: to a place on the way, after so many parts in all.
  struct Command {
    Native place;
    std::size_t parts = 0;
  };
  std::optional<Command> Due(Instant now) const;
  /// Where it begins is not known better than to so many native units: the way may be as much longer.
  void MayBeFarther(double by) { farther_ = by; }
  /// Earlier legs of the same motion have shown its positions to be live.
  void TakeAsLive() { approach_.live = true; }
  /// The motor has taken it.
  void Sent(const Command& command, Instant now);
  /// When the next part is due; nothing once all are sent.
  std::optional<Instant> next_part() const;
  /// What is left of it is not sent: it ends at what has been.
  void CutShort();
  /// The time another axis takes is not this one's.
  void HoldBack(Duration by, Instant now);

  double ShortOf(const drivers::AxisState& state) const;
  /// Readings of this motion were seen to change between its start and its end: neither an echo nor a position that is
  /// told at the end alone does that.
  bool live() const { return approach_.live; }
  /// Nothing tells whether it goes, rests or has gone: no position was seen to be live, and the device either says that
  /// it moves or says nothing of it.
  bool Unseen(const drivers::AxisState& state) const;
  /// How far from a reading the axis may be, if it stands anywhere on this leg; native units.
  double Reach(const drivers::AxisState& state) const;
  /// At its end, as far as a reading tells.
  bool Done(const drivers::AxisState& state, Instant sampled_at) const;
  /// The reference has been found, as far as this reading tells. Where no reading since the command has differed from
  /// the one before it, they may not be live: then only after twice the time that the whole range takes, unless it
  /// began at an end of the range.
  bool FoundReference(const drivers::AxisState& state, Instant sampled_at);
  /// Has gone some way, or is so short that readings could not tell.
  bool Moved(const drivers::AxisState& state) const;
  /// It came nearer and then went away again, by more than overshooting or a missed target explains, and has not come
  /// nearer for longer than registers lag and than the motor needs to show that: another program commands it. Only
  /// readings tell that were seen on the way, or are so late that no register lags any more.
  bool LedAway(const drivers::AxisState& state, Instant sampled_at);
  /// It seems so, and is not certain yet.
  bool MayBeLedAway() const { return approach_.away.since.has_value(); }
  /// Registers may not yet say what is, after a command as new as its last one.
  bool MayLag(Instant sampled_at) const { return sampled_at < times_.last_sent_at + drivers::kRegisterLag; }
  /// Why it will not get there; empty while it may. `settling`: it has been there already. Only positions that are
  /// live, or a device that rests elsewhere by its own word, show a stall.
  std::optional<Trouble> WhatIsWrong(const drivers::AxisState& state, Instant sampled_at, Instant now, bool settling);

 private:
  void Watch(const drivers::AxisState& state, Instant sampled_at);
  Duration LedAwayTime(double margin) const;

  /// What readings have shown of the way to its end.
  struct Approach {
    double closest = 0.0;
    double farthest = 0.0;
    bool seen = false;  ///< to come nearer
    AwayWatch away = {};
    int nearer = 0;        ///< readings on the way, each nearer than all before
    double nearest = 0.0;  ///< of those
    bool live = false;     ///< enough of them
  };
  struct Times {
    Instant commanded_at{};
    Instant last_sent_at{};  ///< of the last part
    Instant expected_at{};   ///< when a device without feedback will have got there
    Instant deadline{};
  };
  struct Progress {
    Native position;
    Instant at{};
  };

  const AxisSetup* setup_;
  Native from_;
  Native to_;
  std::vector<Impulse> parts_;
  bool turns_;
  double farther_ = 0.0;
  std::size_t sent_ = 0;
  Times times_;
  Approach approach_;
  Progress progress_;
};

}  // namespace lensd::rig
