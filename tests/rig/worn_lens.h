// A lens that forwards to the simulated one and reads back what a worn mechanism with an encoder would: positions with
// noise, some time late, and motions that now and then end a few steps beside their target. The encoder tells the
// truth about that; the world behind it is the simulator's.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include "base/clock.h"
#include "drivers/api/lens.h"

namespace lensd::rig {

struct Wear {
  double noise = 0.0;   ///< native units, either way, of every reading
  Duration latency{};   ///< a reading tells how things were so long ago, and looks fresh
  double misses = 0.0;  ///< part of all motions that end beside their target
  int miss_steps = 3;   ///< by up to so many steps
};

class WornLens final : public drivers::Lens {
 public:
  WornLens(std::unique_ptr<drivers::Lens> inner, const Clock& clock, Wear wear, unsigned seed)
      : Lens(inner->capabilities()), inner_(std::move(inner)), clock_(clock), wear_(wear), random_(seed) {}

  int commands() const { return commands_; }

 private:
  Result<void> DoStartHome(drivers::Axis axis) override { return inner_->StartHome(axis); }
  Result<void> DoStartMove(drivers::Axis axis, Native target) override {
    ++commands_;
    const auto& can = *capabilities().axes[axis];
    if (Uniform(0.0, 1.0) < wear_.misses) {
      target.value += std::uniform_int_distribution(-wear_.miss_steps, wear_.miss_steps)(random_) * can.resolution;
      target = std::clamp(target, can.minimum, can.maximum);
    }
    return inner_->StartMove(axis, target);
  }
  Result<void> DoStop(drivers::Axis axis) override { return inner_->Stop(axis); }
  Result<drivers::LensState> DoRead() override {
    auto state = inner_->Read();
    if (!state) return state;
    past_.push_back(*state);
    const Instant then = clock_.Now() - wear_.latency;
    while (past_.size() > 1 && past_[1].sampled_at <= then) past_.pop_front();
    drivers::LensState told = past_.front();
    told.sampled_at = clock_.Now();
    for (const drivers::Axis axis : drivers::kAxes) {
      if (told.axes[axis]) told.axes[axis]->position.value += Uniform(-wear_.noise, wear_.noise);
    }
    return told;
  }
  double Uniform(double low, double high) { return low + (high - low) * (random_() * 0x1.0p-32); }

  std::unique_ptr<drivers::Lens> inner_;
  const Clock& clock_;
  Wear wear_;
  std::mt19937 random_;
  std::deque<drivers::LensState> past_;
  int commands_ = 0;
};

}  // namespace lensd::rig
