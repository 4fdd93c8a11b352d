// One axis: a drive on a bus, and what is under way with it.
//
// A drive is told to go by a few register writes and says through its status how it gets on. What it says cannot be
// taken at its word: a command may be ignored without an alarm, a short motion may be over before the next look, and a
// bit may still be that of the motion before. So a motion has phases here (see Phase) and counts as under way until the
// drive has been seen to move and to rest, or stands where it was sent; when a reading proves either is what
// ArrivalWatch knows. A command that shows no motion in kStartTime is repeated, and after kTries it is a complaint that
// Read() reports as the axis' fault. Absolute targets make repeating harmless.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/arrival_watch.h"
#include "drivers/api/lens.h"
#include "profile.h"
#include "register_access.h"

namespace lensd::drivers::modbus {

/// How one axis is set up: a table of `drives`.
struct DriveConfig {
  drivers::Axis axis = drivers::Axis::Focus;
  int unit = 1;
  Profile profile;
  double low = 0.0;  ///< native units
  double high = 0.0;
  double scale = 1.0;  ///< native units of one count
  double speed = 0.0;  ///< native units per second; 0: not known
  Duration settle{};
};

/// What is asked of a drive.
struct Order {
  enum class Kind { Move, Home, Reset };
  Kind kind = Kind::Move;
  std::int64_t target = 0;  ///< counts
};

/// What a drive said at one instant.
struct Sample {
  Instant at{};  ///< before it was asked
  drivers::AxisState state;
};

/// From one reading to the next a counter of 16 bits seems to have wrapped.
struct Wrapped {
  std::int64_t from = 0, to = 0;
};

/// The bus' thread calls everything but the constructor, config() and label().
class Drive {
 public:
  /// `clock` must outlive it.
  Drive(DriveConfig config, std::string label, const Clock& clock)
      : config_(std::move(config)),
        label_(std::move(label)),
        clock_(clock),
        watch_(static_cast<double>(config_.profile.arrival_counts)) {}

  const DriveConfig& config() const { return config_; }
  /// "focus (unit 1 on bus rs485)".
  const std::string& label() const { return label_; }

  /// Carries out an order as far as that goes without waiting for motion.
  Result<void> Execute(const Order& order, RegisterAccess& talk);
  /// Asks where it is, and does what is due. WrongDevice: it refuses what every drive of its profile answers, and has
  /// never answered it.
  Result<Sample> Look(RegisterAccess& talk);
  /// Ends all motion. What was ordered before is forgotten even if the drive does not answer.
  Result<void> Halt(RegisterAccess& talk);
  /// The connection was lost: the drive may have been switched off meanwhile.
  void Forget();
  /// Something was ordered that has not come to its end.
  bool busy() const { return doing_.phase != Phase::Idle; }

 private:
  enum class Phase {
    Idle,
    Waiting,   ///< for the drive to rest, or to be ready, before the goal is begun
    Starting,  ///< told to go, not seen to move
    Going,     ///< seen to move
  };
  /// Its status and position, as read.
  struct Seen {
    bool moving = false;
    bool ready = true;
    bool in_position = true;
    bool fault = false;
    bool homed = false;
    bool homing = false;
    std::int64_t position = 0;  ///< counts of the target's kind
    double counts = 0.0;        ///< the same, not rounded
    std::int64_t read = 0;      ///< as the registers have it
  };

  /// What is under way.
  struct Doing {
    Phase phase = Phase::Idle;
    Order goal;
    int tries = 0;
    Instant since{};         ///< in this phase
    bool from_rest = false;  ///< the drive rested when the goal was given
    std::optional<Instant> rests_since;
    std::optional<double> began_at;  ///< counts believed when the goal was begun
  };

  struct StopLine {
    bool asserted = false;  ///< to be released
    bool unknown = true;    ///< the program that spoke to it before us may have left it asserted
    bool repeat = false;    ///< sent when a late answer could pass for its own: to be sent again
  };

  Result<Seen> ReadStatus(RegisterAccess& talk);
  Result<void> ReadPosition(RegisterAccess& talk, Seen& seen);
  Result<Sample> Ask(RegisterAccess& talk);
  struct Alarm {
    bool not_homed = false;  ///< only the reference is missing
    std::string text;
  };
  Result<Alarm> ReadAlarm(RegisterAccess& talk);
  Result<void> ResetToHome(const Order& order, RegisterAccess& talk);
  Result<void> Begin(RegisterAccess& talk);
  /// Whether the goal is still under way after `seen`.
  bool Follow(const Seen& seen, bool moves, RegisterAccess& talk);
  bool FollowStart(const Seen& seen, bool moves, RegisterAccess& talk);
  bool FollowMotion(const Seen& seen, RegisterAccess& talk);
  bool FinishHoming(const Seen& seen, RegisterAccess& talk);
  bool Repeat(RegisterAccess& talk, std::string complaint);
  bool Complain(std::string complaint);
  std::string WhatIsOdd(const Seen& seen);
  bool MayWrap(const Seen& seen);
  bool Arrived(const Seen& seen) const;
  bool Homed(const Seen& seen) const;

  const DriveConfig config_;
  const std::string label_;
  const Clock& clock_;
  Doing doing_;
  drivers::ArrivalWatch watch_;     ///< in counts
  std::optional<double> believed_;  ///< counts: the last position that was no echo
  StopLine stop_;
  /// Of positions that cannot be.
  struct {
    int readings = 0;                              ///< in a row, far outside the range
    int passed = 0;                                ///< in a row, beyond the target and still going
    std::int64_t lowest = 0, highest = 0;          ///< as the registers had it so far
    bool jumped = false;                           ///< they came from the range all at once, in a motion
    std::int64_t last_step = 0;                    ///< from one reading to the next
    std::optional<std::int64_t> read_before = {};  ///< as the registers had it
    std::optional<std::int64_t> jumped_from = {};  ///< before the last reading, by about 65536
    std::optional<Wrapped> wrapped = {};           ///< by the last reading, if that was right
  } odd_;
  /// Since the connection was made.
  struct {
    bool homed = false;       ///< by us, for drives that do not tell
    bool recognised = false;  ///< it has answered as a drive of its profile does
  } here_;
  std::string complaint_;
};

}  // namespace lensd::drivers::modbus
