// Whether an axis rests, by registers that do not say the truth for a while after a command.
//
// For some time after a write a position register may show the target that was just written (an echo) or the place from
// before (stale), and "busy" may come late, end early, or never be shown. So nothing is taken for an arrival by one
// look: either positions were read on their way to this target, and the axis has had the time to come there from the
// last of them at the speed that they show; or the target is shown for kRegisterLag, by which registers say what is. A
// device that has shown by several longer moves that its "busy" is true and its position no echo is believed at once
// (trusted()).
#pragma once

#include <optional>

#include "base/clock.h"
#include "base/units.h"

namespace lensd::drivers {

/// So long after a command registers may say what is not (seen: up to 400 ms).
inline constexpr Duration kRegisterLag = std::chrono::milliseconds(420);

/// A reading between the start of a motion and its target.
struct PlaceOnTheWay {
  Native position;
  double to_go = 0.0;  ///< native units from the target
  Instant at{};
};
/// Places that more than one reading speaks for.
struct SeenPlaces {
  std::optional<Native> rested;  ///< where the axis rested, by two readings or by its last motion
  std::optional<Native> live;    ///< of those in motion, the last that was no echo
  std::optional<Native> agreed;  ///< the last place that two of those had in common
};

/// Native units, or any other unit of position that its owner sticks to. Not for several threads at once.
class ArrivalWatch {
 public:
  /// What shows how a motion gets on. Where its positions are none, or repeat the target by their meaning, "busy"
  /// alone.
  enum class Shows { Position, Busy };
  /// Positions that differ by up to `near` are one place.
  explicit ArrivalWatch(double near, Shows by = Shows::Position, Duration lag = kRegisterLag)
      : near_(near), by_(by), lag_(lag) {}

  /// A target has been written.
  void Sent(Native target, Instant now);
  /// The search of the reference has been asked for.
  void Homing(Instant now);
  /// A stop has been written.
  void Stopped(Instant now);
  /// Nothing is under way any more, whatever the registers say.
  void Forget() { motion_ = {}; }

  struct Verdict {
    bool moving = false;                 ///< or nothing proves yet that it rests
    bool echo = false;                   ///< the position may be an echo: what was believed before still is
    std::optional<Native> instead = {};  ///< the last place that was seen on the way, or where it began, if known
  };
  /// What one reading says. `busy`: the device says that it moves.
  Verdict Judge(Native position, bool busy, Instant now);

  /// Since the last command: the device has said that it moves (twice in a row), or was seen to.
  bool seen() const { return motion_.busy_seen || motion_.live; }
  /// Since the last command positions were read on their way to the target.
  bool live() const { return motion_.live; }
  /// The target was read since, and the axis was away from it afterwards: its position had been an echo.
  bool echoed() const { return motion_.contradicted && motion_.there; }
  bool busy_seen() const { return motion_.busy_seen; }
  /// Since the last command it has gone somewhere, or says that it goes.
  bool moved() const;
  /// Several moves in a row have shown that neither its position nor its "busy" lies.
  bool trusted() const;

 private:
  /// What has been seen since a command.
  struct Motion {
    bool under_way = false;
    Instant began{};
    std::optional<Native> target;   ///< none: a search of the reference, or a stop
    std::optional<Native> from;     ///< where it rested before, or was on its way the same way
    std::optional<Native> written;  ///< last target, which a register may echo though it was stopped since
    Instant written_at{};
    Instant differed_at{};       ///< when a reading was last another than the one before
    Duration between_changes{};  ///< the time from one such reading to the next
    double nearest = 0.0;        ///< to the target, of the readings on the way
    int on_the_way = 0;          ///< readings in a row, each nearer than all before
    int busy_readings = 0;       ///< in a row
    int readings = 0;
    bool busy_first = false;  ///< the first reading said so already
    bool busy_seen = false;
    bool onward = false;   ///< it was under way already, the same way
    bool between = false;  ///< a reading was between the start and the target
    bool live = false;
    bool there = false;                                  ///< the target was read
    std::optional<Instant> there_since = {};             ///< every reading since then was of the target
    bool contradicted = false;                           ///< by a later reading
    std::optional<PlaceOnTheWay> first = {}, last = {};  ///< readings on the way
  };

  void Note(Native position, bool busy, Instant now);
  void Follow(Native position, Instant now);
  double Pace() const;
  bool MayBeThere(Instant now) const;
  bool Rests(Native position, bool busy, Instant now) const;
  bool Agrees(Native position, Instant now) const;
  bool Exact(Native position) const;
  bool Near(Native a, Native b) const;
  void Arrive(Instant now);

  const double near_;
  const Shows by_;
  const Duration lag_;
  Motion motion_;
  std::optional<Native> last_;  ///< reading
  SeenPlaces places_;
  bool last_busy_ = false;
  Native anchor_{};  ///< the reading at which the position last changed
  Instant changed_at_{};
  double pace_ = 0.0;  ///< units a second of the slowest of the moves that spoke for the device
  int trust_ = 0;      ///< moves in a row that spoke for the device; below 0: how many it has to make up for
};

}  // namespace lensd::drivers
