// Readings, tried again where that may help. What happened while the lens did not answer is not known: then the history
// is of no use any more, and every axis has to be seen standing anew.
#include "lens_reader.h"

#include <algorithm>

#include "rig/rig.h"
#include "transient.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr Duration kIdlePeriod = std::chrono::milliseconds(500);
constexpr Duration kAgain = std::chrono::milliseconds(2);

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

std::optional<Error> LensReader::Read() {
  auto read = lens_.Read();
  next_read_ = clock_.Now() + kIdlePeriod;
  if (read) {
    problem_.reset();
    failures_ = 0;
    Note(*std::move(read));
    return std::nullopt;
  }
  const Code code = read.error().code;
  if (code == Code::Cancelled) return std::nullopt;  // the command that cut it short is heard first
  ++failures_;
  if (IsTransient(code) && failures_ < kAttempts) {
    next_read_ = clock_.Now() + kAgain;
    return std::nullopt;
  }
  if (!problem_) {
    for (const Axis axis : drivers::kAxes) {
      if (axes_[axis]) axes_[axis]->Lose();
    }
  }
  problem_ = read.error();
  history_.Clear();
  return problem_;
}

void LensReader::Note(drivers::LensState reading) {
  const bool first = !sampled_at_;
  sampled_at_ = reading.sampled_at -= latency_;
  thermometer_.Note(reading.temperature, reading.sampled_at);
  for (const Axis axis : drivers::kAxes) {
    auto& state = reading.axes[axis];
    if (!axes_[axis]) continue;
    if (first && state) axes_[axis]->Recall(*state);
    state = axes_[axis]->Note(std::move(state), *sampled_at_);
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
