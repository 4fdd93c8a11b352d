// A rig on a simulated GigE camera, and what may befall one of its moves.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include "gige_stand.h"
#include "rig/rig.h"

namespace lensd::testing {

/// One thing that goes wrong for a while during a move.
struct Trouble {
  enum class Kind { None, Stale, Lost, Late, False, Power };
  Kind kind = Kind::None;
  Duration after{}, lasting{};
};

class MovingBench {
 public:
  /// `speed`: as configured, native units a second.
  MovingBench(sim::GigeOptions options, std::map<std::string, Settings::Value> keys, std::optional<double> speed = {})
      : stand_(FromFar(std::move(options)), std::move(keys)) {
    auto device = stand_.Open();
    if (!device) throw std::runtime_error(device.error().message);
    rig::RigConfig config;
    config.axes[drivers::Axis::Focus].speed = speed;
    config.axes[drivers::Axis::Focus].settle = std::chrono::milliseconds(20);
    rig_ = rig::Rig::Create(config, *std::move(device), clock_).value();
  }

  /// Until it ends; nothing: it never did. `trouble(begins)` is called when it begins and when it ends.
  template <class Meddle>
  std::optional<Result<rig::MoveOutcome>> Move(double target, const Trouble& trouble, Meddle meddle) {
    std::optional<Result<rig::MoveOutcome>> end;
    rig_->Move(drivers::Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [&](Result<rig::MoveOutcome> outcome) {
                 truth_ = {before_step_, TrueFocus()};
                 end = std::move(outcome);
               });
    const Instant from = clock_.Now() + trouble.after, to = from + trouble.lasting;
    const Instant limit = clock_.Now() + std::chrono::seconds(30);
    bool on = false;
    const auto show = [&](bool now_on) {
      if (std::exchange(on, now_on) != now_on) meddle(now_on);
    };
    while (!end && clock_.Now() < limit) {
      if (trouble.kind != Trouble::Kind::None) show(clock_.Now() > from && clock_.Now() < to);
      StepOnce();
    }
    show(false);
    return end;
  }
  std::optional<Result<rig::MoveOutcome>> Move(double target) {
    return Move(target, {}, [](bool) {});
  }
  /// Steps on until the camera is back, or for a few seconds.
  void AwaitCamera() {
    const Instant limit = clock_.Now() + std::chrono::seconds(5);
    while (!rig_->GetStatus().connected && clock_.Now() < limit) StepOnce();
  }
  /// Steps on until it is seen standing, or for a few seconds.
  void AwaitRest() {
    const Instant limit = clock_.Now() + std::chrono::seconds(5);
    for (int standing = 0; standing < 5 && clock_.Now() < limit;) {
      StepOnce();
      const rig::Status status = rig_->GetStatus();
      const auto& focus = status.axes[drivers::Axis::Focus];
      standing = focus && !focus->moving ? standing + 1 : 0;
    }
  }
  /// Where the mechanism was when the last move ended: not far from here just before the last reading, which an answer
  /// may take long to bring, or then. Nobody can know of a knock in between.
  bool WasAt(double place, double tolerance) const {
    return std::abs(truth_.first - place) <= tolerance || std::abs(truth_.second - place) <= tolerance;
  }
  /// Then.
  double truth() const { return truth_.second; }
  /// Now; not a number while it has no power.
  double TrueFocus() {
    return stand_.plugged() ? stand_.camera().TrueFocus() : std::numeric_limits<double>::quiet_NaN();
  }
  rig::Rig& rig() { return *rig_; }
  GigeStand& stand() { return stand_; }

 private:
  /// What is true is counted from there.
  static sim::GigeOptions FromFar(sim::GigeOptions options) {
    options.focus_zero = sim::GigeFocusZero::Far;
    return options;
  }
  void StepOnce() {
    before_step_ = TrueFocus();
    const Instant next = rig_->Step(clock_.Now());
    std::this_thread::sleep_until(std::min(next, clock_.Now() + std::chrono::milliseconds(2)));
  }

  MonotonicClock clock_;
  GigeStand stand_;
  std::unique_ptr<rig::Rig> rig_;
  double before_step_ = 0.0;
  std::pair<double, double> truth_;
};

inline const std::map<std::string, Settings::Value> kEncoder{{"feedback", std::string("encoder")}};

}  // namespace lensd::testing
