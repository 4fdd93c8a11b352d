// The motors of one LensConnect lens: commands queue behind a busy motor, newest wins, and a motor counts as arrived by
// its own busy bit and position.
#include "lensconnect_lens.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/api/thread_barrier.h"

namespace lensd::drivers::lensconnect {
namespace {

constexpr Duration kFeelPeriod = std::chrono::seconds(5);       ///< between readings of the temperature
constexpr Duration kFarewell = std::chrono::milliseconds(100);  ///< for the last stop, when the lens is closed
constexpr int kIssues = 2;                                      ///< of a command that the lens seems to have missed
constexpr int kAgree = 6;                                       ///< readings, until two in a row agree
constexpr double kZeroCelsius = 273.15;

/// What a lens can stand, in kelvin: other readings are not temperatures.
constexpr double kColdest = 200.0, kHottest = 400.0;

std::string Name(Axis axis) {
  return std::string(AxisName(axis));
}

}  // namespace

Native LensConnectLens::Track::ToNative(std::uint16_t step) const {
  return Native{reversed ? double(minimum) + double(maximum) - step : double(step)};
}

std::uint16_t LensConnectLens::Track::FromNative(Native native) const {
  const double step = reversed ? double(minimum) + double(maximum) - native.value : native.value;
  return static_cast<std::uint16_t>(std::clamp(std::round(step), double(minimum), double(maximum)));
}

LensConnectLens::LensConnectLens(Capabilities capabilities, std::unique_ptr<Registers> registers,
                                 PerAxis<std::optional<Track>> tracks, const Config& config, const Clock& clock)
    : Lens(std::move(capabilities)),
      registers_(std::move(registers)),
      tracks_(std::move(tracks)),
      config_(config),
      clock_(clock) {}

LensConnectLens::~LensConnectLens() {
  Contain([this] { Halt(); });
}

/// Nothing goes on moving unwatched.
void LensConnectLens::Halt() {
  registers_->BeginCall(clock_.Now() + kFarewell);
  for (const Axis axis : kAxes) {
    const auto& track = tracks_[axis];
    if (!track || !track->running || track->stopping || !capabilities().axes[axis]->can_stop) continue;
    if (!registers_->Write(track->motor.base + address::kStop, config_.stop_value)) return;
  }
}

void LensConnectLens::BeginCall() {
  registers_->BeginCall(clock_.Now() + config_.io_timeout);
}

// ---- commands -----------------------------------------------------------------------------------------------------

Result<void> LensConnectLens::DoStartHome(Axis axis) {
  BeginCall();
  return Take(*tracks_[axis], {.home = true, .target = 0});
}

Result<void> LensConnectLens::DoStartMove(Axis axis, Native target) {
  BeginCall();
  Track& track = *tracks_[axis];
  const bool homing = track.running && track.running->home;
  if (!track.homed && !homing) {
    track.queued.reset();
    return Fail(Code::NotHomed, Name(axis) + " does not know where it is yet; home it first");
  }
  return Take(track, {.home = false, .target = track.FromNative(target)});
}

/// The newest command of a motor replaces one that waits; what runs already runs to its end, since no source says what
/// the lens makes of a command while it is busy.
Result<void> LensConnectLens::Take(Track& track, Command command) {
  if (auto looked = LookWhoIsBusy(); !looked) return looked;
  track.fault.clear();
  track.queued.reset();
  track.issued = 0;
  if (MayStart(track)) return Issue(track, command);
  track.queued = command;
  return {};
}

Result<void> LensConnectLens::LookWhoIsBusy() {
  const auto busy = registers_->Read(address::kStatus1);
  if (!busy) return PassOn(busy);
  busy_ = 0;
  for (const Axis axis : kAxes) {
    if (tracks_[axis]) busy_ |= static_cast<std::uint16_t>(*busy & tracks_[axis]->motor.mask);
  }
  return {};
}

bool LensConnectLens::MayStart(const Track& track) const {
  for (const Axis axis : kAxes) {
    const auto& other = tracks_[axis];
    const bool counts = other && (config_.concurrent_axes ? other->motor.mask == track.motor.mask : true);
    if (counts && (other->running || (busy_ & other->motor.mask) != 0)) return false;
  }
  return true;
}

/// Writing the position a motor stands at moves nothing, and busy never rises: it is not written.
Result<void> LensConnectLens::Issue(Track& track, Command command) {
  if (!command.home) {
    const auto position = ReadSettled(track.motor.base + address::kPosition, track.position);
    if (!position) return PassOn(position);
    track.position = *position;
    if (track.position == command.target) return {};
  }
  const auto obeyed = [&] {
    const auto busy = registers_->Read(address::kStatus1);
    return busy && (*busy & track.motor.mask) != 0;
  };
  const std::uint16_t where = track.motor.base + (command.home ? address::kInitialize : address::kPosition);
  const std::uint16_t value = command.home ? 1 : command.target;
  if (command.home) track.homed = false;
  auto written = registers_->Write(where, value, obeyed);
  if (!written && written.error().code == Code::Disconnected) return written;
  // A write that failed may have been obeyed: what the motor does is followed either way, but not helped along.
  track.running = command;
  track.seen_busy = track.stopping = false;
  track.issued = written ? track.issued + 1 : kIssues;
  track.issued_at = clock_.Now();
  return written;
}

Result<void> LensConnectLens::DoStop(Axis axis) {
  BeginCall();
  Track& track = *tracks_[axis];
  track.queued.reset();
  if (auto looked = LookWhoIsBusy(); !looked) return looked;
  if (!track.running && (busy_ & track.motor.mask) == 0) return {};
  return WriteStop(track);
}

Result<void> LensConnectLens::WriteStop(Track& track) {
  if (auto stopped = registers_->Write(track.motor.base + address::kStop, config_.stop_value); !stopped) return stopped;
  track.stopping = true;
  track.issued_at = clock_.Now();
  return {};
}

// ---- looking ------------------------------------------------------------------------------------------------------

Result<LensState> LensConnectLens::DoRead() {
  BeginCall();
  const Instant sampled_at = clock_.Now();
  if (auto looked = LookWhoIsBusy(); !looked) return PassOn(looked);
  for (const Axis axis : kAxes) {
    if (!tracks_[axis]) continue;
    if (auto followed = Follow(*tracks_[axis]); !followed) return PassOn(followed);
  }
  if (auto started = StartQueued(); !started) return PassOn(started);
  if (auto looked = LookAtRest(); !looked) return PassOn(looked);
  return State(sampled_at);
}

/// Where a motor that moves is, and whether it has come to an end.
Result<void> LensConnectLens::Follow(Track& track) {
  const bool is_busy = (busy_ & track.motor.mask) != 0;
  // One that another program moved is looked at once more when it is done.
  if (!track.running && !is_busy && !track.astray) return {};
  track.astray = !track.running && is_busy;
  const auto position = registers_->Read(track.motor.base + address::kPosition);
  if (!position) return PassOn(position);
  track.position = *position;
  if (!track.running) return {};  // another program moves it, or it still brakes
  const bool late = clock_.Now() - track.issued_at > config_.start_timeout;
  if (is_busy) return FollowBusy(track, late);
  // Not busy: at its end, not started yet, or that was another program's reply.
  const bool there = !track.running->home && track.position == track.running->target;
  if (there || track.seen_busy) return Conclude(track);
  if (!late) return {};
  if (track.stopping) return Conclude(track);
  if (track.issued < kIssues) return Issue(track, *track.running);
  if (track.running->home && track.position == track.home_position) return Conclude(track);
  track.fault = track.running->home ? "ignored the command to home" : "ignored the command to move";
  track.running.reset();
  return {};
}

Result<void> LensConnectLens::FollowBusy(Track& track, bool late) {
  const bool just_begun = !std::exchange(track.seen_busy, true);
  if (!track.stopping) return {};
  if (just_begun) return WriteStop(track);  // it began only after it was told to stop
  if (late) track.fault = "the motor continues after a stop command; see stop_value";
  return {};
}

/// Looks a second time. Only what both looks show is the end.
Result<void> LensConnectLens::Conclude(Track& track) {
  if (auto looked = LookWhoIsBusy(); !looked) return looked;
  if ((busy_ & track.motor.mask) != 0) return {};
  const auto position = ReadSettled(track.motor.base + address::kPosition, track.position);
  if (!position) return PassOn(position);
  const auto lost = registers_->Read(address::kStatus2);
  if (!lost) return PassOn(lost);
  track.position = *position;
  track.homed = (*lost & track.motor.mask) == 0;
  const Command ended = *std::exchange(track.running, std::nullopt);
  track.fault.clear();
  if (track.stopping) return {};
  if (!track.homed) {
    track.fault = ended.home ? "did not find its reference" : "lost its reference";
  } else if (!ended.home && track.position != ended.target) {
    track.fault =
        "came to rest at step " + std::to_string(track.position) + " instead of " + std::to_string(ended.target);
  }
  return {};
}

Result<void> LensConnectLens::StartQueued() {
  for (const Axis axis : kAxes) {
    auto& track = tracks_[axis];
    if (!track || !track->queued || !MayStart(*track)) continue;
    const Command command = *std::exchange(track->queued, std::nullopt);
    if (!command.home && !track->homed) {
      track->fault = "does not know where it is; home it first";
      continue;
    }
    track->issued = 0;
    if (auto issued = Issue(*track, command); !issued) {
      track->queued = track->running ? std::nullopt : std::optional(command);
      return issued;
    }
  }
  return {};
}

/// A lens may lose its power, or be turned by another program: what stands is looked at too. While a motor moves, only
/// whether the others still have their references: what turns unseen is busy (and followed), or has been without power.
/// A change has to be seen twice.
Result<void> LensConnectLens::LookAtRest() {
  std::uint16_t known_lost = 0, resting = 0;
  bool moving = busy_ != 0;
  for (const Axis axis : kAxes) {
    const auto& track = tracks_[axis];
    if (!track) continue;
    moving = moving || track->running || track->queued;
    if (!track->homed) known_lost |= track->motor.mask;
    if (!track->running) resting |= track->motor.mask;
  }
  const auto lost = ReadSettled(address::kStatus2, known_lost);
  if (!lost) return PassOn(lost);
  if (moving && ((*lost ^ known_lost) & resting) == 0) return {};
  for (const Axis axis : kAxes) {
    auto& track = tracks_[axis];
    if (!track || track->running || (busy_ & track->motor.mask) != 0) continue;
    const auto position = ReadSettled(track->motor.base + address::kPosition, track->position);
    if (!position) return PassOn(position);
    track->position = *position;
    const bool homed = (*lost & track->motor.mask) == 0;
    if (track->homed && !homed) track->fault = "lost its reference (was the lens without power?)";
    track->homed = homed;
  }
  if (moving) return {};
  const Instant now = clock_.Now();
  if (!felt_at_ || now - *felt_at_ >= kFeelPeriod) {
    const auto kelvin = registers_->Read(address::kTemperature);
    if (!kelvin) return PassOn(kelvin);
    const bool sensible = *kelvin > kColdest && *kelvin < kHottest;
    temperature_ = sensible ? std::optional(Celsius{*kelvin - kZeroCelsius}) : std::nullopt;
    felt_at_ = now;
  }
  return {};
}

/// A register that should not change: what differs from `expected` has to be read twice in a row.
Result<std::uint16_t> LensConnectLens::ReadSettled(std::uint16_t where, std::uint16_t expected) {
  std::uint16_t before = expected;
  for (int i = 0; i < kAgree; ++i) {
    const auto value = registers_->Read(where);
    if (!value || *value == before) return value;
    before = *value;
  }
  return Fail(Code::Protocol, "the lens gives a different answer each time");
}

LensState LensConnectLens::State(Instant sampled_at) const {
  LensState state{.sampled_at = sampled_at, .axes = {}, .temperature = temperature_};
  for (const Axis axis : kAxes) {
    const auto& track = tracks_[axis];
    if (!track) continue;
    const bool moving = track->running || track->queued || (busy_ & track->motor.mask) != 0;
    state.axes[axis] = AxisState{.position = track->ToNative(track->position),
                                 .moving = moving,
                                 .homed = track->homed,
                                 .waiting = track->queued.has_value(),
                                 .fault = track->fault};
  }
  return state;
}

}  // namespace lensd::drivers::lensconnect
