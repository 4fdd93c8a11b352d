// Exposure times on a grid: the same frame number is always exposed at the same time, whichever rig asks and when.
#include "sim/camera/frame_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::sim {
namespace {

constexpr std::int64_t kEndless = std::numeric_limits<std::int64_t>::max();

std::int64_t DivideUp(Duration a, Duration b) {
  return (a.count() + b.count() - 1) / b.count();
}

}  // namespace

FrameGrid::FrameGrid(double frame_rate_hz, Duration exposure)
    : period_(std::max<Duration::rep>(1, std::llround(1e9 / frame_rate_hz))), exposure_(exposure) {}

std::int64_t FrameGrid::CellFrom(Duration now) const {
  return DivideUp(now, period_);
}

Exposure FrameGrid::Nth(const Run& run, std::int64_t n) const {
  return {period_ * (run.first + n * run.cells), run.length, run.sequence + static_cast<std::uint64_t>(n)};
}

void FrameGrid::Start(Duration now) {
  if (streaming_) return;
  runs_.clear();
  streaming_ = true;
  SetExposure(now, exposure_);
}

void FrameGrid::Stop(Duration now) {
  if (streaming_) End(now);
  streaming_ = false;
}

void FrameGrid::End(Duration now) {
  if (runs_.empty()) return;
  Run& run = runs_.back();
  run.frames = std::max<std::int64_t>(0, DivideUp(now - period_ * run.first, period_ * run.cells));
  next_sequence_ = run.sequence + static_cast<std::uint64_t>(run.frames);
  next_cell_ = run.first + run.frames * run.cells;
  if (run.frames == 0) runs_.pop_back();
}

void FrameGrid::SetExposure(Duration now, Duration exposure) {
  exposure_ = exposure;
  if (!streaming_) return;
  End(now);
  const std::int64_t first = std::max(next_cell_, CellFrom(now));
  runs_.push_back({first, DivideUp(exposure, period_), exposure, next_sequence_, kEndless});
  // Only the newest exposures are ever asked for.
  if (runs_.size() > 16) runs_.erase(runs_.begin());
}

std::optional<Exposure> FrameGrid::NewestDone(Duration now) const {
  for (auto run = runs_.rbegin(); run != runs_.rend(); ++run) {
    const Duration since = now - run->length - period_ * run->first;
    if (since < Duration::zero()) continue;
    const std::int64_t done = since / (period_ * run->cells) + 1;
    return Nth(*run, std::min(done, run->frames) - 1);
  }
  return std::nullopt;
}

std::optional<Exposure> FrameGrid::Numbered(std::uint64_t sequence) const {
  for (auto run = runs_.rbegin(); run != runs_.rend(); ++run) {
    if (sequence < run->sequence) continue;
    const auto n = static_cast<std::int64_t>(sequence - run->sequence);
    if (n < run->frames) return Nth(*run, n);
  }
  return std::nullopt;
}

}  // namespace lensd::sim
