// A motor that counts its steps, with a shaft whose place is known, under a rig that ends and begins anew.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "rig_fixture.h"

namespace lensd::rig {

using namespace std::chrono_literals;
using drivers::Feedback;

constexpr double kTravel = 1000.0;
constexpr double kSpeed = 500.0;  // steps a second

/// A motor with a shaft and a controller that counts its steps. The count is the shaft's place until the power fails.
struct Bench {
  double from = 0.0, to = 0.0;  ///< of the shaft
  Instant began{};
  double zero = 0.0;      ///< the shaft's place where the controller counts 0
  double saved = 0.0;     ///< the count that it last wrote to its own memory
  double speed = kSpeed;  ///< steps a second
  double ramp = 0.0;      ///< seconds until it goes that fast, and as long to stop
  Duration refresh{};     ///< how often the count that it reports is renewed
  bool answers = true;
  int unanswered = 0;              ///< the next so many questions fail, with `says`
  Code says = Code::Disconnected;  ///< a question that fails
  Instant says_moving_until{};     ///< its "moving" is late
  int false_zeros = 0;             ///< the next so many readings say 0, whatever is true
  int old_readings = 0;            ///< the next so many readings say what was before the power failed
  double old_count = 0.0;
  bool old_moving = false;
  double lowest = kTravel, highest = 0.0;  ///< that the shaft has been sent to

  double ShaftAt(Instant now) const {
    const double gone = Gone(std::abs(to - from), std::chrono::duration<double>(now - began).count());
    return gone >= std::abs(to - from) ? to : from + std::copysign(gone, to - from);
  }
  /// Of a way of `steps`, after `seconds`: the speed rises and falls evenly.
  double Gone(double steps, double seconds) const {
    if (ramp <= 0.0) return speed * seconds;
    const double top = std::min(speed, std::sqrt(steps * speed / ramp)), ramps = ramp * top / speed;
    const double whole = steps > 0.0 ? steps / top + ramps : 0.0;
    const double rest = whole - seconds;
    if (rest <= 0.0) return steps;
    if (seconds < ramps) return 0.5 * top * seconds * seconds / ramps;
    if (rest < ramps) return steps - 0.5 * top * rest * rest / ramps;
    return top * (seconds - 0.5 * ramps);
  }
  /// What the count shows.
  double ShownAt(Instant now) const {
    const auto at = refresh > Duration::zero() ? now - now.time_since_epoch() % refresh : now;
    return ShaftAt(std::max(at, began));
  }
  bool MovingAt(Instant now) const { return ShaftAt(now) != to; }
  void Halt(Instant now) {
    from = to = std::round(ShaftAt(now));
    began = now;
  }
  /// Stops dead, and counts from `count` where it stands.
  void LosePower(Instant now, double count) {
    Halt(now);
    zero = to - count;
  }
};

struct Kind {
  Feedback feedback = Feedback::Counts;
  bool can_home = false;
  bool speed_known = true;
  bool counts_below_zero = true;
  bool OnlyCounts() const { return feedback == Feedback::Counts && !can_home; }
};

class CountingLens final : public drivers::Lens {
 public:
  CountingLens(const Clock& clock, std::shared_ptr<Bench> bench, const Kind& kind)
      : Lens(CapabilitiesOf(kind)), clock_(clock), bench_(std::move(bench)), kind_(kind) {}

 private:
  static drivers::Capabilities CapabilitiesOf(const Kind& kind) {
    drivers::Capabilities can{.driver = "bench", .model = "bench", .serial = "1", .axes = {}};
    drivers::AxisCapabilities focus{
        .maximum = Native{kTravel}, .feedback = kind.feedback, .can_home = kind.can_home, .backlash = 0.0};
    if (kind.speed_known) focus.speed = kSpeed;
    if (kind.counts_below_zero) focus.counts = {Native{-kTravel}, Native{2.0 * kTravel}};
    can.axes[Axis::Focus] = focus;
    return can;
  }
  Result<void> Answer() const {
    const bool fails = bench_->unanswered > 0;
    if (fails) --bench_->unanswered;
    if (!bench_->answers || fails) return Fail(bench_->says, "no power, or no cable");
    return {};
  }
  void Go(double to) {
    const Instant now = clock_.Now();
    bench_->from = bench_->ShaftAt(now);
    bench_->to = to;
    bench_->began = now;
    bench_->lowest = std::min(bench_->lowest, to);
    bench_->highest = std::max(bench_->highest, to);
  }
  Result<void> DoStartHome(Axis) override {
    if (auto answer = Answer(); !answer) return answer;
    Go(0.0);
    bench_->zero = 0.0;
    homed_ = true;
    return {};
  }
  Result<void> DoStartMove(Axis, Native target) override {
    if (auto answer = Answer(); !answer) return answer;
    told_ = target.value;
    Go((kind_.feedback == Feedback::Encoder ? 0.0 : bench_->zero) + target.value);
    return {};
  }
  Result<void> DoStop(Axis) override {
    if (auto answer = Answer(); !answer) return answer;
    bench_->Halt(clock_.Now());
    return {};
  }
  Result<drivers::LensState> DoRead() override {
    if (auto answer = Answer(); !answer) return PassOn(answer);
    const Instant now = clock_.Now();
    const double count = std::round(bench_->ShownAt(now) - bench_->zero);
    const bool moving = bench_->MovingAt(now);
    if (!moving) bench_->saved = count;
    drivers::LensState state;
    state.sampled_at = now;
    auto& focus = state.axes[Axis::Focus].emplace();
    focus.moving = moving || now < bench_->says_moving_until;
    focus.position = Native{kind_.feedback == Feedback::Encoder ? std::round(bench_->ShaftAt(now))
                            : drivers::Follows(kind_.feedback)  ? count
                                                                : told_.value_or(count)};
    if (bench_->false_zeros > 0) {
      --bench_->false_zeros;
      focus.position = Native{0.0};
      focus.moving = false;
    }
    if (bench_->old_readings > 0) {
      --bench_->old_readings;
      focus.position = Native{bench_->old_count};
      focus.moving = bench_->old_moving;
    }
    return state;
  }

  const Clock& clock_;
  std::shared_ptr<Bench> bench_;
  const Kind kind_;
  std::optional<double> told_;
  bool homed_ = false;
};

/// Outlives the rigs, as the state folder does.
struct Disk {
  PositionMemory::Axes axes;
};
class DiskMemory final : public PositionMemory {
 public:
  explicit DiskMemory(std::shared_ptr<Disk> disk) : disk_(std::move(disk)) {}
  Result<Axes> Load() override { return disk_->axes; }
  Result<void> Save(const Axes& axes) override {
    disk_->axes = axes;
    return {};
  }

 private:
  std::shared_ptr<Disk> disk_;
};

/// A rig on such a motor, with optics, through restarts.
struct Station {
  SteppedClock clock;
  std::shared_ptr<Bench> bench = std::make_shared<Bench>();
  std::shared_ptr<Disk> disk = std::make_shared<Disk>();
  Kind kind;
  RigConfig config;
  std::unique_ptr<Rig> rig;

  ~Station() { rig.reset(); }
  void Open() {
    rig.reset();
    config.axes[Axis::Focus].direction = drivers::Direction::NearPositive;
    drivers::Device device{.lens = std::make_unique<CountingLens>(clock, bench, kind),
                           .camera = nullptr,
                           .optics = drivers::NominalOptics{.focal_length_m = 0.025,
                                                            .min_f_number = 2.0,
                                                            .max_f_number = 2.0,
                                                            .min_extension_m = 0.0,
                                                            .max_extension_m = 1e-3}};
    auto made = Rig::Create(config, std::move(device), clock, nullptr, std::make_unique<DiskMemory>(disk));
    ASSERT_TRUE(made) << made.error().message;
    rig = *std::move(made);
  }
  /// Ends lensd at once: what it would still have written is not.
  void Kill() {
    const Disk kept = *disk;
    const Bench before = *bench;
    rig.reset();
    *disk = kept;
    *bench = before;
  }
  void Run(Duration how_long) {
    const Instant end = clock.Now() + how_long;
    while (clock.Now() < end) {
      const Instant next = rig->Step(clock.Now());
      clock.AdvanceTo(std::min(std::max(next, clock.Now() + 100us), end));
    }
  }
  template <class T>
  Result<T> Await(const Answers<T>& answers) {
    const Instant end = clock.Now() + 100s;
    while (answers.all.empty() && clock.Now() < end) Run(1ms);
    return answers.only();
  }
  Result<MoveOutcome> Move(const Target& target) {
    Answers<MoveOutcome> answers;
    rig->Move(Axis::Focus, target, answers.Take());
    return Await(answers);
  }
  Result<MoveOutcome> Home() {
    Answers<MoveOutcome> answers;
    rig->Home(Axis::Focus, answers.Take());
    return Await(answers);
  }
  Result<void> Say(double position) {
    Answers<void> answers;
    rig->SetPosition(Axis::Focus, Native{position}, answers.Take());
    return Await(answers);
  }
  AxisStatus Focus() { return *rig->GetStatus().axes[Axis::Focus]; }
  double Shaft() { return bench->ShaftAt(clock.Now()); }
};

inline Target By(double steps) {
  return {.kind = Target::Kind::NativeRelative, .value = steps, .from = {}, .take_up = {}};
}
inline Target ToExtension(double native) {
  return {.kind = Target::Kind::Extension, .value = 1e-3 * native / kTravel, .from = {}, .take_up = {}};
}

}  // namespace lensd::rig
