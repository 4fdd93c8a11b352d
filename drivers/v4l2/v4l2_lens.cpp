// Codes written along a ramp, and what can honestly be said about where the lens is: most of these devices tell nothing
// back.
#include "v4l2_lens.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace lensd::drivers::v4l2 {
namespace {

using drivers::Axis;

/// A code that is read back unlike the one written, and has stood still so long, will not change any more.
constexpr Duration kStoodStill = std::chrono::milliseconds(300);

double Seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

struct CodeLens::AxisRun {
  Axis axis = Axis::Focus;
  std::unique_ptr<Actuator> actuator;
  double scale = 1.0;
  double codes_per_s = 0.0;  ///< 0: one write
  std::function<Result<void>()> take{};

  std::int64_t from = 0;  ///< where the ramp under way began
  std::int64_t target = 0;
  std::int64_t written = 0;
  Instant began{};
  bool known = false;                ///< `written` is what the device has
  std::optional<std::int64_t> seen;  ///< read back last
  Instant changed{};                 ///< when `seen` or `written` last did
  bool confirmed = true;             ///< `seen` has been what was written
  std::string fault;                 ///< of the last move
  std::string notice;                ///< of what others did

  bool ramping() const { return written != target; }

  Native PositionOf(std::int64_t code) const { return Native{static_cast<double>(code) * scale}; }

  std::int64_t Due(Instant now) const {
    if (codes_per_s <= 0.0 || !known) return target;
    const CodeRange range = actuator->range();
    const double travelled =
        std::floor(codes_per_s * std::max(0.0, Seconds(now - began)) / static_cast<double>(range.step));
    const std::int64_t distance = std::abs(target - from);
    if (travelled * static_cast<double>(range.step) >= static_cast<double>(distance)) return target;
    const std::int64_t way = static_cast<std::int64_t>(travelled) * range.step;
    return from + (target > from ? way : -way);
  }

  Result<void> Write(std::int64_t code, Instant now) {
    if (auto done = actuator->Write(code); !done) return done;
    if (code != written || !known) changed = now;
    written = code;
    known = true;
    confirmed = false;
    return {};
  }

  /// To a place that was asked for: where another program has switched on an automatism, that is switched off first.
  Result<void> Go(std::int64_t code, Instant now) {
    if (take && !notice.empty()) {
      if (auto taken = take(); !taken) return taken;
    }
    auto started = Start(code, now);
    if (started || !take || started.error().code != Code::Busy) return started;
    if (auto taken = take(); !taken) return taken;
    return Start(code, now);
  }

  Result<void> Start(std::int64_t code, Instant now) {
    from = written;
    target = code;
    began = now;
    fault.clear();
    notice.clear();
    auto done = Write(Due(now), now);
    if (!done) target = written;
    return done;
  }

  /// What the device says now. Fails where it is gone.
  Result<void> Look(Instant now) {
    const auto read = actuator->Read();
    if (!read) return PassOn(read);
    if (*read != seen) changed = now;
    seen = *read;
    if (!seen || ramping()) return {};
    if (*seen == written) {
      confirmed = true;
      fault.clear();
    } else if (confirmed && !actuator->live()) {
      // It was as written before: another program has moved it, and nothing is wrong with that.
      written = target = *seen;
    } else if (now - changed >= kStoodStill) {
      fault = "it took " + std::to_string(*seen) + " instead of " + std::to_string(written);
    }
    return {};
  }

  drivers::AxisState State(Instant now) const {
    const bool differs = seen && *seen != written;
    drivers::AxisState state;
    state.position = PositionOf(differs && !ramping() ? *seen : written);
    if (actuator->live() && seen) state.position = PositionOf(*seen);
    state.moving = ramping() || (differs && now - changed < kStoodStill);
    state.homed = known;
    state.fault = notice.empty() ? fault : notice;
    return state;
  }
};

Result<std::unique_ptr<drivers::Lens>> CodeLens::Make(drivers::Capabilities who, std::vector<AxisParts> axes,
                                                      std::shared_ptr<void> held, std::unique_ptr<Changes> changes,
                                                      drivers::Findings& findings, const Clock& clock) {
  std::vector<AxisRun> runs;
  for (AxisParts& parts : axes) {
    AxisRun run;
    run.axis = parts.axis;
    run.scale = parts.config.scale;
    run.codes_per_s = parts.config.speed.value_or(0.0) / parts.config.scale;
    run.actuator = std::move(parts.actuator);
    run.take = std::move(parts.take);
    auto read = run.actuator->Read();
    if (!read && !drivers::ConcernsAll(read.error())) read = run.actuator->Read();
    if (!read && drivers::ConcernsAll(read.error())) return PassOn(read);
    if (!read) {
      findings.LeaveOut(drivers::AxisName(run.axis), read.error());
      continue;
    }
    const CodeRange range = run.actuator->range();
    run.known = read->has_value();
    run.seen = *read;
    run.written = run.target = run.from = std::clamp(read->value_or(range.minimum), range.minimum, range.maximum);
    run.changed = clock.Now();
    drivers::AxisCapabilities can;
    can.unit = parts.config.unit;
    can.minimum = run.PositionOf(range.minimum);
    can.maximum = run.PositionOf(range.minimum + (range.maximum - range.minimum) / range.step * range.step);
    can.resolution = run.PositionOf(range.step).value;
    can.feedback = run.actuator->live() ? drivers::Feedback::Counts
                   : read->has_value()  ? drivers::Feedback::Echo
                                        : drivers::Feedback::None;
    can.can_stop = run.codes_per_s > 0.0;
    can.speed = parts.config.speed.value_or(0.0);
    can.settle = parts.config.settle.value_or(Duration::zero());
    can.direction = parts.direction;
    who.axes[parts.axis] = can;
    runs.push_back(std::move(run));
  }
  if (runs.empty()) return std::unique_ptr<drivers::Lens>();
  return std::unique_ptr<drivers::Lens>(
      new CodeLens(std::move(who), std::move(runs), std::move(held), std::move(changes), clock));
}

CodeLens::CodeLens(drivers::Capabilities can, std::vector<AxisRun> axes, std::shared_ptr<void> held,
                   std::unique_ptr<Changes> changes, const Clock& clock)
    : Lens(std::move(can)),
      held_(std::move(held)),
      changes_(std::move(changes)),
      axes_(std::move(axes)),
      clock_(clock) {}

CodeLens::AxisRun& CodeLens::RunOf(Axis axis) {
  return *std::ranges::find(axes_, axis, &AxisRun::axis);
}

Result<void> CodeLens::DoStartHome(Axis axis) {
  return Fail(Code::Unsupported, std::string(drivers::AxisName(axis)) + " has no reference to home to");
}

Result<void> CodeLens::DoStartMove(Axis axis, Native target) {
  AxisRun& run = RunOf(axis);
  const CodeRange range = run.actuator->range();
  const std::int64_t steps =
      std::llround((target.value / run.scale - static_cast<double>(range.minimum)) / static_cast<double>(range.step));
  return run.Go(std::clamp(range.minimum + steps * range.step, range.minimum, range.maximum), clock_.Now());
}

Result<void> CodeLens::DoStop(Axis axis) {
  AxisRun& run = RunOf(axis);
  return run.Start(run.written, clock_.Now());
}

Result<drivers::LensState> CodeLens::DoRead() {
  const Instant now = clock_.Now();
  TakeChanges();
  for (AxisRun& run : axes_) {
    if (run.ramping()) {
      if (auto done = run.Write(run.Due(now), now); !done) return PassOn(done);
    }
    if (auto looked = run.Look(now); !looked) return PassOn(looked);
  }
  drivers::LensState state;
  state.sampled_at = clock_.Now();
  for (const AxisRun& run : axes_) state.axes[run.axis] = run.State(state.sampled_at);
  return state;
}

/// Codes that can be read are read at every look; of the others, what is told is all there is.
void CodeLens::TakeChanges() {
  if (!changes_) return;
  for (const Change& change : changes_->Take()) {
    const auto run = std::ranges::find(axes_, change.axis, &AxisRun::axis);
    if (run == axes_.end()) continue;
    if (!change.notice.empty()) run->notice = change.notice;
    if (change.code && !run->seen && !run->ramping()) run->written = run->target = *change.code;
  }
}

}  // namespace lensd::drivers::v4l2
