// Focus for cameras that only know nearer, farther and stop: position is time travelled, which is an estimate and is
// reported as such.
#include "relative_focus.h"

#include <algorithm>
#include <cmath>

namespace lensd::drivers::uvc {
namespace {

constexpr double kHomingMargin = 1.25;  // of the travel: the far end is met for sure

double Milliseconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-6;
}
Duration FromMilliseconds(double ms) {
  return Duration(std::llround(ms * 1e6));
}

}  // namespace

double RelativeFocus::Travelled(Instant now) const {
  const double moved = direction_ * Milliseconds(now - began_);
  return std::clamp(position_ms_ + moved, 0.0, Milliseconds(travel_));
}

Result<void> RelativeFocus::Run(int direction, Duration how_long) {
  if (direction_ != 0 && direction_ != direction) {
    if (auto halted = Halt(); !halted) return halted;
  }
  if (direction_ == 0) {
    began_ = clock_.Now();
    const Sent sent = send_(direction);
    if (!sent.result && sent.without_effect) return sent.result;
    direction_ = direction;
    if (!sent.result) {
      // Where the answer is lost it may be running: it is stopped at once, but where it is is not known.
      due_ = began_;
      homed_ = homing_ = false;
      return sent.result;
    }
    began_ = clock_.Now();
  } else {
    position_ms_ = Travelled(clock_.Now());
    began_ = clock_.Now();
  }
  due_ = began_ + how_long;
  return {};
}

Result<void> RelativeFocus::Halt() {
  const Sent sent = send_(0);
  if (!sent.result) {
    if (!sent.without_effect) homed_ = homing_ = false;  // when it stopped, if it did, is not known
    return sent.result;
  }
  position_ms_ = Travelled(clock_.Now());
  direction_ = 0;
  return {};
}

Result<void> RelativeFocus::StartHome() {
  homing_ = true;
  homed_ = false;
  target_ms_.reset();
  return Run(-1, FromMilliseconds(kHomingMargin * Milliseconds(travel_)));
}

Result<void> RelativeFocus::StartMove(double target_ms) {
  if (!homed_) return Fail(Code::NotHomed, "focus: this camera knows only nearer and farther; home it first");
  homing_ = false;
  target_ms_ = target_ms;
  corrections_ = 0;
  return Continue();
}

Result<void> RelativeFocus::Continue() {
  const double left = *target_ms_ - Travelled(clock_.Now());
  if (std::abs(left) <= 0.5 * resolution_ms_) return direction_ != 0 ? Halt() : Result<void>();
  return Run(left > 0 ? 1 : -1, FromMilliseconds(std::abs(left)));
}

Result<void> RelativeFocus::Stop() {
  homing_ = false;
  target_ms_.reset();
  return Halt();
}

Result<AxisState> RelativeFocus::Read() {
  if (direction_ != 0 && clock_.Now() >= due_) {
    if (auto halted = Halt(); !halted) return PassOn(halted);
    if (homing_) {
      homing_ = false;
      homed_ = true;
      position_ms_ = 0.0;
    }
  }
  AxisState state;
  if (direction_ == 0 && homed_ && target_ms_ && std::abs(*target_ms_ - position_ms_) > 0.5 * resolution_ms_) {
    if (++corrections_ <= kMostCorrections) {
      if (auto again = Continue(); !again) return PassOn(again);
    } else {
      state.fault = "stops too late to arrive";
    }
  }
  state.position = Native{Travelled(clock_.Now())};
  state.moving = direction_ != 0 || !state.fault.empty();
  state.homed = homed_;
  return state;
}

}  // namespace lensd::drivers::uvc
