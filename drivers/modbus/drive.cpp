// One drive's motion by its registers, in phases, because its status may lag behind the command. The bus thread calls;
// nothing here waits.
#include "drive.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace lensd::drivers::modbus {
namespace {

using std::chrono::milliseconds;

constexpr Duration kStartTime = milliseconds(450);        ///< a drive that has taken a command shows it by then
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
    doing_.phase = Phase::Idle;
    watch_.Forget();
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
  doing_.goal = order;
  doing_.tries = 0;
  doing_.from_rest = !seen->moving;
  stop_.repeat = false;
  complaint_.clear();
  const bool take_over = order.kind == Order::Kind::Move && !config_.profile.stop_to_retarget;
  if (seen->moving && !take_over) {
    if (auto stopped = talk.Run(config_.profile.stop, config_.profile, 0); !stopped) return stopped;
    stop_.asserted = !config_.profile.release.empty();
    watch_.Stopped(clock_.Now());
  }
  doing_.since = clock_.Now();
  if (seen->moving ? !take_over : !seen->ready) {
    doing_.phase = Phase::Waiting;
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
  if (doing_.tries > 0) {
    if (auto rearmed = talk.Run(profile.rearm, profile, 0); !rearmed) return rearmed;
  }
  const Sequence& sequence = doing_.goal.kind == Order::Kind::Home ? profile.home : profile.move;
  if (doing_.goal.kind == Order::Kind::Home) here_.homed = false;
  if (auto told = talk.Run(sequence, profile, doing_.goal.target); !told) return told;
  ++doing_.tries;
  doing_.phase = Phase::Starting;
  doing_.since = clock_.Now();
  doing_.rests_since.reset();
  doing_.began_at = believed_;
  odd_.last_step = 0;
  if (doing_.goal.kind == Order::Kind::Home) {
    watch_.Homing(doing_.since);
  } else {
    watch_.Sent(Native{static_cast<double>(doing_.goal.target)}, doing_.since);
  }
  return {};
}

Result<void> Drive::Halt(RegisterAccess& talk) {
  doing_.phase = Phase::Idle;
  complaint_.clear();
  stop_.repeat = true;
  stop_.asserted = !config_.profile.release.empty();
  watch_.Stopped(clock_.Now());
  const bool suspect = talk.suspect();
  auto stopped = talk.Run(config_.profile.stop, config_.profile, 0);
  if (stopped && !suspect) stop_.repeat = false;
  return stopped;
}

void Drive::Forget() {
  doing_.phase = Phase::Idle;
  watch_.Forget();
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
  if (auto placed = ReadPosition(talk, *seen); !placed) return PassOn(placed);
  sample.state.homed = Homed(*seen);
  if (seen->fault) {
    auto alarm = ReadAlarm(talk);
    if (!alarm) return PassOn(alarm);
    sample.state.fault = std::move(alarm->text);
  }
  if (const std::string odd = WhatIsOdd(*seen); !odd.empty()) {
    // Where the drive is sent by such numbers nobody knows.
    if (doing_.phase != Phase::Idle) (void)Halt(talk);
    Complain(odd);
  }
  const auto verdict = watch_.Judge(Native{seen->counts}, seen->moving || seen->homing, clock_.Now());
  if (!verdict.echo) {
    believed_ = seen->counts;
  } else {
    believed_ = verdict.instead.value_or(Native{believed_.value_or(seen->counts)}).value;
  }
  sample.state.moving = Follow(*seen, verdict.moving, talk) || seen->moving;
  sample.state.position = Native{*believed_ * config_.scale};
  if (sample.state.fault.empty()) sample.state.fault = complaint_;
  return sample;
}

bool Drive::Arrived(const Seen& seen) const {
  return doing_.goal.kind == Order::Kind::Move &&
         std::llabs(seen.position - doing_.goal.target) <= config_.profile.arrival_counts;
}

bool Drive::Homed(const Seen& seen) const {
  if (config_.profile.homed) return seen.homed;
  return here_.homed || !config_.profile.homing_required;
}

bool Drive::Complain(std::string complaint) {
  complaint_ = std::move(complaint);
  doing_.phase = Phase::Idle;
  watch_.Forget();
  return false;
}

/// Tells the drive once more, unless it was told often enough.
bool Drive::Repeat(RegisterAccess& talk, std::string complaint) {
  if (doing_.tries >= kTries) return Complain(std::move(complaint));
  (void)Begin(talk);  // what fails is done by the next look
  return doing_.phase != Phase::Idle;
}

bool Drive::Follow(const Seen& seen, bool moves, RegisterAccess& talk) {
  const bool held = stop_.asserted || (stop_.unknown && doing_.phase == Phase::Waiting);
  if (held && !seen.moving && talk.Run(config_.profile.release, config_.profile, 0)) {
    stop_.asserted = stop_.unknown = false;
  }
  if (seen.fault) {
    doing_.phase = Phase::Idle;
    watch_.Forget();
    return false;
  }
  switch (doing_.phase) {
    case Phase::Idle:
      return moves;
    case Phase::Waiting:
      if (!seen.moving && seen.ready) {
        (void)Begin(talk);
      } else if (clock_.Now() - doing_.since > kReadyTime) {
        return Complain("the drive does not get ready for the next motion");
      }
      return doing_.phase != Phase::Idle;
    case Phase::Starting:
      return FollowStart(seen, moves, talk);
    case Phase::Going:
      if (!moves) return FollowMotion(seen, talk);
      doing_.rests_since.reset();
      return true;
  }
  return false;
}

bool Drive::FollowStart(const Seen& seen, bool moves, RegisterAccess& talk) {
  if (!doing_.began_at) doing_.began_at = believed_;
  if (!moves && Arrived(seen) && seen.in_position) {
    doing_.phase = Phase::Idle;
    return false;
  }
  if (seen.moving || seen.homing || watch_.moved()) {
    doing_.phase = Phase::Going;
    return moves || FollowMotion(seen, talk);
  }
  if (clock_.Now() - doing_.since <= kStartTime) return true;
  // A drive that stands at its reference already may see no reason to move.
  const bool at_home = doing_.goal.kind == Order::Kind::Home && config_.profile.homed && seen.homed &&
                       std::llabs(seen.position) <= config_.profile.arrival_counts;
  if (at_home) return FinishHoming(seen, talk);
  return Repeat(talk, doing_.goal.kind == Order::Kind::Home
                          ? "the drive takes the command to home and does not move, without an alarm"
                          : "the drive takes the command to move and does not move, without an alarm");
}

/// It has moved, and seems to rest.
bool Drive::FollowMotion(const Seen& seen, RegisterAccess& talk) {
  if (!doing_.rests_since) doing_.rests_since = clock_.Now();
  const bool long_enough = clock_.Now() - *doing_.rests_since > kRestTime;
  if (doing_.goal.kind == Order::Kind::Home) {
    if (Homed(seen) || !config_.profile.homed) return FinishHoming(seen, talk);
    return long_enough ? Complain("homing ended without a reference") : true;
  }
  if (!seen.in_position && !long_enough) return true;
  // Far from the target, it was the motion before that ended: the drive has not taken the new target.
  const auto left = std::llabs(seen.position - doing_.goal.target);
  // From rest there was no motion before: whoever went elsewhere since was sent there by somebody else.
  const bool elsewhere = doing_.from_rest &&
                         std::abs(seen.counts - *doing_.began_at) > static_cast<double>(config_.profile.arrival_counts);
  const bool ignored =
      left > config_.profile.arrival_counts && !elsewhere &&
      10.0 * static_cast<double>(left) > std::abs(static_cast<double>(doing_.goal.target) - *doing_.began_at);
  if (ignored && doing_.from_rest && seen.in_position && watch_.busy_seen() && seen.counts == *doing_.began_at) {
    return Complain("the drive says that it moved, and its position still reads " + std::to_string(seen.position) +
                    ": is [position] of its profile at the right address, and as wide as the drive has it?");
  }
  if (ignored && doing_.tries < kTries) return Repeat(talk, "");
  doing_.phase = Phase::Idle;
  return false;
}

bool Drive::FinishHoming(const Seen&, RegisterAccess& talk) {
  if (!talk.Run(config_.profile.after_home, config_.profile, 0)) return doing_.phase != Phase::Idle;  // next look
  here_.homed = true;
  doing_.phase = Phase::Idle;
  watch_.Forget();
  // The position just read may be from before the reference was set.
  return !config_.profile.after_home.empty();
}

}  // namespace lensd::drivers::modbus
