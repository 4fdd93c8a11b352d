// A lens and a camera of a few lines each on a stepped clock, with switches for everything that can go wrong.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "drivers/api/device.h"

namespace lensd::testing {

/// What a test may turn while the device is in use, and what it may count.
struct FakeControls {
  double speed = 1000.0;       ///< native units per second
  bool stalled = false;        ///< motors stand still whatever they are told
  bool waiting = false;        ///< they say that they wait for another axis
  bool disconnected = false;   ///< every call fails
  int lost_read_replies = 0;   ///< the next so many reads time out
  int lost_move_replies = 0;   ///< the next so many moves time out, though obeyed
  bool stale = false;          ///< reads repeat the last state, with its old time
  std::string fault;           ///< what focus complains of, standing still and at its target
  bool forgives = false;       ///< the next command of focus ends the fault
  bool dark = false;           ///< the camera gives no frames
  double sharp_at = 600.0;     ///< focus position of the subject
  bool on_demand = false;      ///< what it says of how its frames come about
  double told_rate_hz = 0.0;   ///< what the camera says of its frame rate when it is made; 0: nothing
  double contrast = 0.5;       ///< of its texture; 0: blank
  double temperature_c = NAN;  ///< what its thermometer says; NAN: it has none
  enum class Shows { Way, Target, Start };
  Shows shows = Shows::Way;   ///< what focus says while it moves: where it is, where it goes, or where it was
  bool says_nothing = false;  ///< focus has no status: it never says that it moves, and its arrival is assumed
  bool hangs = false;         ///< focus stays where it is, and says that it moves
  int short_moves = 0;        ///< the next so many moves of focus end `short_by` before their target
  double short_by = 0.0;
  std::optional<double> counts_anew;  ///< focus has been without power, and calls where it stands so, at the next read
  std::optional<double> foreign_target;            ///< another program sends focus there, at the next read
  std::optional<drivers::AxisCapabilities> focus;  ///< instead of its own, when the device is made
  std::optional<drivers::Direction> direction = drivers::Direction::NearPositive;  ///< that its driver vouches for
  std::vector<double> focus_targets;                                               ///< of every move of focus so far
  int moves = 0, reads = 0, stops = 0, homes = 0;
  int camera_starts = 0;
};

/// Focus 0..1000 and iris 0..100 with encoders, zoom without feedback, all at `speed`.
class FakeLens final : public drivers::Lens {
 public:
  FakeLens(const Clock& clock, std::shared_ptr<FakeControls> controls, double focus)
      : Lens(MakeCapabilities(*controls)), clock_(clock), controls_(std::move(controls)) {
    for (const auto axis : drivers::kAxes) motors_[axis] = {0.0, 0.0, clock_.Now(), {}};
    motors_[drivers::Axis::Focus].from = motors_[drivers::Axis::Focus].to = focus;
  }

  double PositionNow(drivers::Axis axis) const {
    const Motor& motor = motors_[axis];
    if (motor.hung_at) return *motor.hung_at;
    const double travelled = std::chrono::duration<double>(clock_.Now() - motor.began).count() * controls_->speed;
    const double distance = motor.to - motor.from;
    return travelled >= std::abs(distance) ? motor.to : motor.from + std::copysign(travelled, distance);
  }

 private:
  struct Motor {
    double from = 0.0, to = 0.0;
    Instant began{};
    std::optional<double> hung_at = {};
  };

  static drivers::Capabilities MakeCapabilities(const FakeControls& controls) {
    drivers::Capabilities can{.driver = "fake", .model = "fake", .serial = "1", .axes = {}};
    const auto measured = drivers::Feedback::Encoder;
    can.axes[drivers::Axis::Focus] = {
        .maximum = Native{1000.0}, .feedback = measured, .can_home = true, .backlash = 0.0};
    if (controls.focus) can.axes[drivers::Axis::Focus] = controls.focus;
    if (controls.direction) can.axes[drivers::Axis::Focus]->direction = {*controls.direction, "the fake lens"};
    can.axes[drivers::Axis::Iris] = {.maximum = Native{100.0}, .feedback = measured, .backlash = 0.0};
    can.axes[drivers::Axis::Zoom] = {.maximum = Native{100.0}, .feedback = drivers::Feedback::None, .can_stop = false};
    return can;
  }

  /// Whether one was left; it is taken.
  static bool OneOf(int& left) {
    if (left <= 0) return false;
    --left;
    return true;
  }

  Result<void> Answer() const {
    if (controls_->disconnected) return Fail(Code::Disconnected, "the fake lens is unplugged");
    return {};
  }

  void Go(drivers::Axis axis, double to) {
    const double from = PositionNow(axis);
    motors_[axis] = {from, controls_->stalled ? from : to, clock_.Now(), {}};
  }

  Result<void> DoStartHome(drivers::Axis axis) override {
    ++controls_->homes;
    if (auto answer = Answer(); !answer) return answer;
    Go(axis, 0.0);
    return {};
  }

  Result<void> DoStartMove(drivers::Axis axis, Native target) override {
    ++controls_->moves;
    if (auto answer = Answer(); !answer) return answer;
    double to = target.value;
    if (axis == drivers::Axis::Focus) {
      if (controls_->forgives) controls_->fault.clear();
      controls_->focus_targets.push_back(to);
      if (OneOf(controls_->short_moves)) {
        to += std::copysign(controls_->short_by, PositionNow(axis) - to);
      }
    }
    Go(axis, to);
    if (OneOf(controls_->lost_move_replies)) return Fail(Code::Timeout, "no reply");
    return {};
  }

  Result<drivers::LensState> DoRead() override {
    ++controls_->reads;
    if (auto answer = Answer(); !answer) return PassOn(answer);
    if (OneOf(controls_->lost_read_replies)) return Fail(Code::Timeout, "no reply");
    if (controls_->stale) return last_;
    if (controls_->counts_anew) {
      const double from = *std::exchange(controls_->counts_anew, {});
      motors_[drivers::Axis::Focus] = {from, from, clock_.Now(), {}};
    }
    if (controls_->foreign_target) Go(drivers::Axis::Focus, *std::exchange(controls_->foreign_target, {}));
    last_.sampled_at = clock_.Now();
    last_.temperature.reset();
    if (!std::isnan(controls_->temperature_c)) last_.temperature = Celsius{controls_->temperature_c};
    for (const auto axis : drivers::kAxes) {
      const auto& can = capabilities().axes[axis];
      if (!can) continue;
      const double position = PositionNow(axis);
      last_.axes[axis] = drivers::AxisState{.position = Native{can->follows() ? position : motors_[axis].to},
                                            .moving = position != motors_[axis].to || controls_->waiting,
                                            .waiting = controls_->waiting,
                                            .fault = {}};
    }
    ShowFocus(*last_.axes[drivers::Axis::Focus], motors_[drivers::Axis::Focus]);
    if (!controls_->fault.empty()) {
      last_.axes[drivers::Axis::Focus]->moving = false;
      last_.axes[drivers::Axis::Focus]->fault = controls_->fault;
    }
    return last_;
  }

  /// As cameras tell it that do not measure.
  void ShowFocus(drivers::AxisState& state, Motor& motor) const {
    if (controls_->hangs && !motor.hung_at && state.moving) motor.hung_at = state.position.value;
    using Shows = FakeControls::Shows;
    if (state.moving && controls_->shows == Shows::Target) state.position = Native{motor.to};
    if (state.moving && controls_->shows == Shows::Start) state.position = Native{motor.from};
    if (!controls_->says_nothing) return;
    state.moving = false;
    state.assumed = true;
  }

  Result<void> DoStop(drivers::Axis axis) override {
    ++controls_->stops;
    if (auto answer = Answer(); !answer) return answer;
    Go(axis, PositionNow(axis));
    return {};
  }

  const Clock& clock_;
  std::shared_ptr<FakeControls> controls_;
  drivers::PerAxis<Motor> motors_;
  drivers::LensState last_;
};

/// 64 x 64 px, 8 bits, 100 frames a second, each exposed for 5 ms: a fixed random pattern that loses contrast with the
/// distance from `sharp_at`, plus noise that differs from frame to frame.
class FakeCamera final : public drivers::Camera {
 public:
  static constexpr int kSize = 64;
  static constexpr Duration kPeriod = std::chrono::milliseconds(10);
  static constexpr Duration kExposure = std::chrono::milliseconds(5);

  FakeCamera(const Clock& clock, std::shared_ptr<FakeControls> controls, const FakeLens* lens)
      : Camera({.driver = "fake",
                .model = "fake",
                .serial = "1",
                .width = kSize,
                .height = kSize,
                .on_demand = controls->on_demand,
                .pixel_um = 5.0,
                .frame_rate_hz = controls->told_rate_hz,
                .focus_region = {0.0, 0.0, 1.0, 1.0}}),
        clock_(clock),
        controls_(std::move(controls)),
        lens_(lens) {}

 private:
  Result<void> DoStart() override {
    if (!streaming_) ++controls_->camera_starts;
    if (!streaming_) next_ = clock_.Now();
    streaming_ = true;
    return {};
  }
  Result<void> DoStop() override {
    streaming_ = false;
    return {};
  }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    if (!streaming_) return Fail(Code::InvalidArgument, "not streaming");
    if (controls_->dark || clock_.Now() < next_ + kExposure) return std::nullopt;
    // The newest complete one.
    while (next_ + kPeriod + kExposure <= clock_.Now()) next_ += kPeriod;
    drivers::Frame frame;
    frame.width = frame.height = kSize;
    frame.sequence = ++sequence_;
    frame.exposure_start = next_;
    frame.exposure_end = next_ + kExposure;
    frame.samples = Picture();
    next_ += kPeriod;
    return frame;
  }

  std::shared_ptr<std::vector<std::uint16_t>> Picture() const {
    const double blur = (lens_->PositionNow(drivers::Axis::Focus) - controls_->sharp_at) / 20.0;
    const double contrast = controls_->contrast / (1.0 + blur * blur);
    auto samples = std::make_shared<std::vector<std::uint16_t>>();
    std::uint64_t texture = 1, noise = sequence_ + 17;
    for (int i = 0; i < kSize * kSize; ++i) {
      const double value = 120.0 * (1.0 + contrast * (Random(texture) - 0.5)) + 4.0 * (Random(noise) - 0.5);
      samples->push_back(static_cast<std::uint16_t>(std::clamp(value + 0.5, 0.0, 255.0)));
    }
    return samples;
  }

  /// xorshift64*, in [0, 1).
  static double Random(std::uint64_t& state) {
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return static_cast<double>((state * 0x2545F4914F6CDD1DULL) >> 11) * 0x1.0p-53;
  }

  const Clock& clock_;
  std::shared_ptr<FakeControls> controls_;
  const FakeLens* lens_;
  bool streaming_ = false;
  Instant next_{};
  std::uint64_t sequence_ = 0;
};

/// 25 mm lens, 0..1 mm of extension, f/2 to f/16. The lens outlives the camera, which looks through it.
inline drivers::Device MakeFakeDevice(const Clock& clock, const std::shared_ptr<FakeControls>& controls,
                                      double focus = 100.0) {
  auto lens = std::make_unique<FakeLens>(clock, controls, focus);
  auto camera = std::make_unique<FakeCamera>(clock, controls, lens.get());
  return {.lens = std::move(lens),
          .camera = std::move(camera),
          .optics = drivers::NominalOptics{.focal_length_m = 0.025,
                                           .min_f_number = 2.0,
                                           .max_f_number = 16.0,
                                           .min_extension_m = 0.0,
                                           .max_extension_m = 1e-3}};
}

}  // namespace lensd::testing
