// One drive's motion by its registers, in phases, because its status may lag behind the command. The bus thread calls;
// nothing here waits.
#include "drive.h"

#include <array>
#include <cstdlib>
#include <utility>

namespace lensd::drivers::modbus {
namespace {

using std::chrono::milliseconds;

constexpr Duration kStartTime = milliseconds(250);  ///< a drive that has taken a command moves, or is there, by then
constexpr Duration kReadyTime = std::chrono::seconds(2);  ///< for a stopped drive to rest and be ready
constexpr Duration kRestTime = milliseconds(500);  ///< at rest, but not "in position" or "homed": this is how it ends
constexpr int kTries = 3;

/// Of a drive that has been known to have what it says now that it has not.
Error Contradiction(Error error) {
  if (error.code == Code::Unsupported) error.code = Code::Protocol;
  return error;
}

}  // namespace

Result<std::int64_t> RegisterAccess::ReadNumber(const Place& place, WordOrder order) {
  std::array<std::uint16_t, 2> registers{};
  const std::span used = std::span(registers).first(static_cast<std::size_t>(RegistersOf(place.type)));
  if (auto read = Read(place.address, used); !read) return PassOn(read);
  return NumberAt(used, place.type, order);
}

Result<void> RegisterAccess::Run(const Sequence& sequence, const Profile& profile, std::int64_t target) {
  for (const WriteStep& step : sequence) {
    const auto registers = RegistersOf(step, profile, target);
    if (!registers) return PassOn(registers);
    if (auto written = Write(step.function, step.address, *registers); !written) return written;
  }
  return {};
}

Result<Drive::Seen> Drive::ReadStatus(RegisterAccess& talk) {
  const Profile& profile = config_.profile;
  std::map<std::uint16_t, std::int64_t> numbers;
  Seen seen;
  const std::pair<const std::optional<Flag>&, bool Seen::*> flags[] = {
      {profile.moving, &Seen::moving}, {profile.ready, &Seen::ready}, {profile.in_position, &Seen::in_position},
      {profile.fault, &Seen::fault},   {profile.homed, &Seen::homed}, {profile.homing, &Seen::homing}};
  for (const auto& [flag, member] : flags) {
    if (!flag) continue;
    const Place& place = flag->place;
    if (!numbers.contains(place.address)) {
      const auto number = talk.ReadNumber(place, profile.word_order);
      if (!number) return PassOn(number);
      numbers[place.address] = *number;
    }
    seen.*member = ((numbers[place.address] >> flag->bit) & 1) != (flag->inverted ? 1 : 0);
  }
  if (!profile.moving) seen.moving = !seen.in_position;
  return seen;
}

Result<Drive::Alarm> Drive::ReadAlarm(RegisterAccess& talk) {
  const Profile& profile = config_.profile;
  Alarm alarm;
  if (profile.alarm) {
    const auto number = talk.ReadNumber(*profile.alarm, profile.word_order);
    if (!number) return PassOn(number);
    alarm.text = AlarmText(profile, *number);
    alarm.not_homed = profile.alarm_not_homed && (*number & profile.alarm_mask) == *profile.alarm_not_homed;
  }
  if (alarm.text.empty()) alarm.text = "the drive reports a fault";
  return alarm;
}

/// A drive that complains obeys nothing before it is reset. Where only its reference is missing, the search of that is
/// the cure.
Result<void> Drive::ResetToHome(const Order& order, RegisterAccess& talk) {
  const auto alarm = ReadAlarm(talk);
  if (!alarm) return PassOn(alarm);
  if (!alarm->not_homed) {
    return Fail(Code::Unsupported, label_ + " does not move before its fault is reset: " + alarm->text);
  }
  if (order.kind != Order::Kind::Home) {
    return Fail(Code::NotHomed, label_ + " has no reference yet: home it first (" + alarm->text + ")");
  }
  return talk.Run(config_.profile.reset, config_.profile, 0);
}

Result<void> Drive::Execute(const Order& order, RegisterAccess& talk) {
  if (order.kind == Order::Kind::Reset) {
    complaint_.clear();
    phase_ = Phase::Idle;
    return talk.Run(config_.profile.reset, config_.profile, 0);
  }
  auto seen = ReadStatus(talk);
  if (seen && seen->fault) {
    if (auto reset = ResetToHome(order, talk); !reset) return reset;
    seen = ReadStatus(talk);
  }
  if (!seen) return std::unexpected(Contradiction(seen.error()));
  if (order.kind == Order::Kind::Move && config_.profile.homing_required && !Homed(*seen)) {
    return Fail(Code::NotHomed, label_ + " has no reference yet: home it first");
  }
  goal_ = order;
  tries_ = 0;
  stop_.repeat = false;
  complaint_.clear();
  const bool take_over = order.kind == Order::Kind::Move && !config_.profile.stop_to_retarget;
  if (seen->moving && !take_over) {
    if (auto stopped = talk.Run(config_.profile.stop, config_.profile, 0); !stopped) return stopped;
    stop_.asserted = !config_.profile.release.empty();
  }
  phase_since_ = clock_.Now();
  if (seen->moving ? !take_over : !seen->ready) {
    phase_ = Phase::Waiting;
    return {};
  }
  return Begin(talk);
}

/// Tells the drive to go for the goal.
Result<void> Drive::Begin(RegisterAccess& talk) {
  const Profile& profile = config_.profile;
  if (stop_.asserted || stop_.unknown) {
    if (auto released = talk.Run(profile.release, profile, 0); !released) return released;
    stop_.asserted = stop_.unknown = false;
  }
  if (tries_ > 0) {
    if (auto rearmed = talk.Run(profile.rearm, profile, 0); !rearmed) return rearmed;
  }
  const Sequence& sequence = goal_.kind == Order::Kind::Home ? profile.home : profile.move;
  if (goal_.kind == Order::Kind::Home) here_.homed = false;
  if (auto told = talk.Run(sequence, profile, goal_.target); !told) return told;
  ++tries_;
  phase_ = Phase::Starting;
  phase_since_ = clock_.Now();
  rests_since_.reset();
  began_at_.reset();
  return {};
}

Result<void> Drive::Halt(RegisterAccess& talk) {
  phase_ = Phase::Idle;
  complaint_.clear();
  stop_.repeat = true;
  stop_.asserted = !config_.profile.release.empty();
  const bool suspect = talk.suspect();
  auto stopped = talk.Run(config_.profile.stop, config_.profile, 0);
  if (stopped && !suspect) stop_.repeat = false;
  return stopped;
}

void Drive::Forget() {
  phase_ = Phase::Idle;
  here_ = {};
  stop_.repeat = false;
  stop_.unknown = true;
}

Result<Sample> Drive::Look(RegisterAccess& talk) {
  auto sample = Ask(talk);
  if (sample) {
    here_.recognised = true;
  } else if (sample.error().code == Code::Unsupported) {
    if (here_.recognised) return std::unexpected(Contradiction(sample.error()));
    return Fail(Code::WrongDevice,
                sample.error().message + ": what is there is no drive of profile " + config_.profile.name);
  }
  return sample;
}

Result<Sample> Drive::Ask(RegisterAccess& talk) {
  if (stop_.repeat) {
    if (auto stopped = talk.Run(config_.profile.stop, config_.profile, 0); !stopped) return PassOn(stopped);
    stop_.repeat = false;
  }
  Sample sample{.at = clock_.Now(), .state = {}};
  auto seen = ReadStatus(talk);
  if (!seen) return PassOn(seen);
  const auto position = talk.ReadNumber(config_.profile.position, config_.profile.word_order);
  if (!position) return PassOn(position);
  const double counts = static_cast<double>(*position) * config_.profile.position_scale;
  seen->position = static_cast<std::int64_t>(counts < 0 ? counts - 0.5 : counts + 0.5);
  sample.state.position = Native{counts * config_.scale};
  sample.state.homed = Homed(*seen);
  if (seen->fault) {
    auto alarm = ReadAlarm(talk);
    if (!alarm) return PassOn(alarm);
    sample.state.fault = std::move(alarm->text);
  }
  sample.state.moving = Follow(*seen, talk) || seen->moving;
  if (sample.state.fault.empty()) sample.state.fault = complaint_;
  return sample;
}

bool Drive::Arrived(const Seen& seen) const {
  return goal_.kind == Order::Kind::Move && std::llabs(seen.position - goal_.target) <= config_.profile.arrival_counts;
}

bool Drive::Homed(const Seen& seen) const {
  if (config_.profile.homed) return seen.homed;
  return here_.homed || !config_.profile.homing_required;
}

bool Drive::Complain(std::string complaint) {
  complaint_ = std::move(complaint);
  phase_ = Phase::Idle;
  return false;
}

/// Tells the drive once more, unless it was told often enough.
bool Drive::Repeat(RegisterAccess& talk, std::string complaint) {
  if (tries_ >= kTries) return Complain(std::move(complaint));
  (void)Begin(talk);  // what fails is done by the next look
  return phase_ != Phase::Idle;
}

bool Drive::Follow(const Seen& seen, RegisterAccess& talk) {
  const bool held = stop_.asserted || (stop_.unknown && phase_ == Phase::Waiting);
  if (held && !seen.moving && talk.Run(config_.profile.release, config_.profile, 0)) {
    stop_.asserted = stop_.unknown = false;
  }
  if (phase_ != Phase::Idle && seen.fault) phase_ = Phase::Idle;
  switch (phase_) {
    case Phase::Idle:
      return false;
    case Phase::Waiting:
      if (!seen.moving && seen.ready) {
        (void)Begin(talk);
      } else if (clock_.Now() - phase_since_ > kReadyTime) {
        return Complain("the drive does not get ready for the next motion");
      }
      return phase_ != Phase::Idle;
    case Phase::Starting:
      return FollowStart(seen, talk);
    case Phase::Going:
      return FollowMotion(seen, talk);
  }
  return false;
}

bool Drive::FollowStart(const Seen& seen, RegisterAccess& talk) {
  if (!began_at_) began_at_ = seen.position;
  if (seen.moving || seen.homing) {
    phase_ = Phase::Going;
    return true;
  }
  if (Arrived(seen) && seen.in_position) {
    phase_ = Phase::Idle;
    return false;
  }
  if (clock_.Now() - phase_since_ <= kStartTime) return true;
  // A drive that stands at its reference already may see no reason to move.
  const bool at_home = goal_.kind == Order::Kind::Home && config_.profile.homed && seen.homed &&
                       std::llabs(seen.position) <= config_.profile.arrival_counts;
  if (at_home) return FinishHoming(seen, talk);
  return Repeat(talk, goal_.kind == Order::Kind::Home
                          ? "the drive takes the command to home and does not move, without an alarm"
                          : "the drive takes the command to move and does not move, without an alarm");
}

bool Drive::FollowMotion(const Seen& seen, RegisterAccess& talk) {
  if (seen.moving || seen.homing) {
    rests_since_.reset();
    return true;
  }
  if (!rests_since_) rests_since_ = clock_.Now();
  const bool long_enough = clock_.Now() - *rests_since_ > kRestTime;
  if (goal_.kind == Order::Kind::Home) {
    if (Homed(seen) || !config_.profile.homed) return FinishHoming(seen, talk);
    return long_enough ? Complain("homing ended without a reference") : true;
  }
  if (!seen.in_position && !long_enough) return true;
  // Far from the target, it was the motion before that ended: the drive has not taken the new target.
  const auto left = std::llabs(seen.position - goal_.target);
  const bool ignored = left > config_.profile.arrival_counts && 10 * left > std::llabs(goal_.target - *began_at_);
  if (ignored && tries_ < kTries) return Repeat(talk, "");
  phase_ = Phase::Idle;
  return false;
}

bool Drive::FinishHoming(const Seen&, RegisterAccess& talk) {
  if (!talk.Run(config_.profile.after_home, config_.profile, 0)) return phase_ != Phase::Idle;  // next look
  here_.homed = true;
  phase_ = Phase::Idle;
  // The position just read may be from before the reference was set.
  return !config_.profile.after_home.empty();
}

}  // namespace lensd::drivers::modbus
