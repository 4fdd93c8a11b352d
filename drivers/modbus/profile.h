// What is particular to one family of drives: which registers mean what, as data.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/settings.h"
#include "drivers/api/lens.h"
#include "values.h"

namespace lensd::drivers::modbus {

/// One number of a write: fixed, the target of a motion, or a parameter.
struct Field {
  NumberType type = NumberType::U16;
  std::string name;  ///< empty: `number`; "target"; else a parameter
  std::int64_t number = 0;
};

/// Registers written at once.
struct WriteStep {
  std::uint16_t address = 0;
  int function = 16;  ///< 6 (one register) or 16
  std::vector<Field> fields;
};
using Sequence = std::vector<WriteStep>;

/// A number that is read.
struct Place {
  std::uint16_t address = 0;
  NumberType type = NumberType::U16;
};

/// One bit of a number that is read.
struct Flag {
  Place place;
  int bit = 0;
  bool inverted = false;
};

struct Profile {
  std::string name;
  WordOrder word_order = WordOrder::HighFirst;
  std::optional<char> parity;    ///< 'N', 'E', 'O': as the drives leave the factory
  Duration gap{};                ///< silence the drive wants between frames beyond what Modbus asks
  int read_function = 3;         ///< 3 or 4
  bool stop_to_retarget = true;  ///< a motion under way is stopped before the next
  drivers::Feedback feedback = drivers::Feedback::Counts;  ///< what the position is
  std::int64_t arrival_counts = 2;  ///< this near to its target a drive that shows no motion has arrived

  std::optional<Flag> moving, ready, in_position, fault, homed, homing;
  Place position;
  double position_scale = 1.0;  ///< counts of the target's kind for one count read
  std::optional<Place> alarm;
  bool alarm_is_bits = false;  ///< a set of alarms, else a code
  std::int64_t alarm_mask = -1;
  std::map<std::int64_t, std::string> alarm_names;  ///< by code, or by number of the bit
  std::optional<std::int64_t> alarm_not_homed;      ///< the code that says: no reference, home it first

  Sequence move, rearm, home, after_home, stop, release, reset;
  bool homing_required = false;
  std::map<std::string, std::int64_t> parameters;

  std::string speed_parameter;      ///< empty: the speed is not known
  double speed_counts_per_s = 0.0;  ///< of one unit of that parameter; 0: see speed_revolutions_per_s
  double speed_revolutions_per_s = 0.0;

  /// Registers that may be read in any number from 1 to `probe_count`, for replies of unlikely lengths.
  std::optional<Place> probe;
  int probe_count = 0;
  int probe_step = 1;
};

/// The key `feedback` of a table. BadData is recorded in `read`.
drivers::Feedback ReadFeedback(SettingsReader& read, drivers::Feedback fallback);

/// Reads a profile's table. BadData: "file:line: what is wrong".
Result<Profile> ReadProfile(const Settings& table);

/// The registers `step` writes. OutOfRange: a number that does not fit where it goes.
Result<std::vector<std::uint16_t>> RegistersOf(const WriteStep& step, const Profile& profile, std::int64_t target);

/// "alarm 0x30: overload", "alarm: over-temperature, encoder". Empty: none.
std::string AlarmText(const Profile& profile, std::int64_t alarm);

}  // namespace lensd::drivers::modbus
