// Readings, tried again where that may help. What happened while the lens did not answer is not known: then the history
// is of no use any more, and every axis has to be seen standing anew.
#include "rig/frames/lens_reader.h"

#include <algorithm>

#include "rig/common/retries.h"
#include "rig/rig.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr Duration kIdlePeriod = std::chrono::milliseconds(500);
constexpr Duration kAgain = std::chrono::milliseconds(2);
constexpr Duration kDoubtPeriod = std::chrono::milliseconds(20);  ///< where a reading may be wrong
constexpr Duration kHaltPeriod = std::chrono::milliseconds(50);   ///< while a motor is still to be told to stop

drivers::PerAxis<double> Tolerances(const AxisControllers& axes) {
  drivers::PerAxis<double> tolerances;
  for (const Axis axis : drivers::kAxes) tolerances[axis] = axes[axis] ? axes[axis]->setup().tolerance : 0.0;
  return tolerances;
}

}  // namespace

LensReader::LensReader(drivers::Lens& lens, const AxisControllers& axes, const RigConfig& config, const Clock& clock)
    : lens_(lens), axes_(axes), clock_(clock), history_(Tolerances(axes)), thermometer_(config.temperature) {
  for (const Axis axis : drivers::kAxes) {
    if (axes_[axis]) latency_ = std::max(latency_, config.axes[axis].latency);
  }
}

/// A lens that says that it is busy is there, and is asked again: by a motion until its own deadline, else for a while.
/// Answers that are lost, late or broken are asked for again a few times, and by a motion for as long as it can wait.
bool LensReader::AsksAgain(Code code, Instant now) const {
  const bool moves =
      std::ranges::any_of(drivers::kAxes, [&](Axis axis) { return axes_[axis] && axes_[axis]->motion(); });
  const bool follows = !problem_ && moves && sampled_at_;
  if (code == Code::Busy) return !problem_ && (follows || now - *unread_.busy_since < kBusyPatience);
  return IsTransient(code) && (unread_.failures < kAttempts || (follows && now - unread_.heard_at < kBusyPatience));
}

void LensReader::NoteBrokenLink() {
  if (problem_) return;
  for (const Axis axis : drivers::kAxes) {
    if (axes_[axis]) axes_[axis]->Lose(AxisController::Loss::Link);
  }
  history_.Clear();
  ReadSoon();
}

std::optional<Error> LensReader::Read() {
  if (unread_.busy_since && !problem_ && clock_.Now() < next_read_) return std::nullopt;
  auto read = lens_.Read();
  const Instant now = clock_.Now();
  next_read_ = now + kIdlePeriod;
  if (read) {
    problem_.reset();
    unread_ = {};
    unread_.heard_at = now;
    Note(*std::move(read));
    return std::nullopt;
  }
  const Code code = read.error().code;
  if (code == Code::Cancelled) return std::nullopt;  // the command that cut it short is heard first
  for (const Axis axis : drivers::kAxes) {
    if (axes_[axis]) axes_[axis]->Lose(AxisController::Loss::Answer);
  }
  if (code == Code::Busy) {
    unread_.failures = 0;
    unread_.heard_at = now;
    if (!unread_.busy_since) unread_.busy_since = now;
  } else {
    ++unread_.failures;
  }
  if (AsksAgain(code, now)) {
    next_read_ = now + (code == Code::Busy ? kBusyAgain : kAgain);
    return std::nullopt;
  }
  const auto halts = [&](Axis axis) { return axes_[axis] && axes_[axis]->halt_is_due(); };
  if (code != Code::Disconnected && std::ranges::any_of(drivers::kAxes, halts)) next_read_ = now + kHaltPeriod;
  const Instant next = next_read_;
  NoteBrokenLink();
  next_read_ = next;
  problem_ = StillBusy(read.error());
  return problem_;
}

void LensReader::Note(drivers::LensState reading) {
  const bool first = !sampled_at_;
  ++count_;
  sampled_at_ = reading.sampled_at -= latency_;
  thermometer_.Note(reading.temperature, reading.sampled_at);
  for (const Axis axis : drivers::kAxes) {
    auto& state = reading.axes[axis];
    if (!axes_[axis]) continue;
    if (first && state) axes_[axis]->Recall(*state);
    state = axes_[axis]->Note(std::move(state), *sampled_at_);
    if (axes_[axis]->in_doubt()) next_read_ = std::min(next_read_, clock_.Now() + kDoubtPeriod);
  }
  history_.Add(reading);
}

void LensReader::Describe(Status& status) const {
  status.temperature = temperature();
  status.temperature_fault = thermometer_.fault();
  status.temperatures_left_out = thermometer_.left_out();
}

bool LensReader::Moving() const {
  return std::ranges::any_of(drivers::kAxes, [&](Axis axis) { return axes_[axis] && axes_[axis]->moving(); });
}

std::optional<Instant> LensReader::SteadySince() const {
  if (Moving() || !connected()) return std::nullopt;
  Instant since{};
  for (const Axis axis : drivers::kAxes) {
    if (axes_[axis]) since = std::max(since, axes_[axis]->steady_since());
  }
  return since;
}

}  // namespace lensd::rig
