// A lens whose readings are late: each says what was true a while ago, under the time it was asked for.
#pragma once

#include <deque>
#include <memory>
#include <utility>

#include "drivers/api/lens.h"

namespace lensd::bench {

class LateLens final : public drivers::Lens {
 public:
  LateLens(std::unique_ptr<drivers::Lens> lens, Duration delay)
      : drivers::Lens(lens->capabilities()), lens_(std::move(lens)), delay_(delay) {}

 private:
  Result<void> DoStartHome(drivers::Axis axis) override { return lens_->StartHome(axis); }
  Result<void> DoStartMove(drivers::Axis axis, Native target) override { return lens_->StartMove(axis, target); }
  Result<void> DoStop(drivers::Axis axis) override { return lens_->Stop(axis); }
  Result<void> DoResetFault(drivers::Axis axis) override { return lens_->ResetFault(axis); }
  void DoInterrupt() override { lens_->Interrupt(); }

  Result<drivers::LensState> DoRead() override {
    auto read = lens_->Read();
    if (!read) return read;
    const Instant asked_at = read->sampled_at;
    past_.push_back(*std::move(read));
    while (past_.size() > 1 && past_[1].sampled_at <= asked_at - delay_) past_.pop_front();
    drivers::LensState late = past_.front();
    late.sampled_at = asked_at;
    return late;
  }

  std::unique_ptr<drivers::Lens> lens_;
  Duration delay_;
  std::deque<drivers::LensState> past_;
};

}  // namespace lensd::bench
