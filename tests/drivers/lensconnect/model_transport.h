// The simulated lens behind the driver's transport seam: on a stepped clock time passes only as reports go to and fro.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>

#include "base/clock.h"
#include "sim/devices/lensconnect.h"
#include "transport.h"

namespace lensd::testing {

/// A lens, and whether it is plugged in. Shared, so that it outlives the driver.
struct ModelLens {
  explicit ModelLens(const Clock& clock, sim::devices::LensConnectTraits traits = {})
      : lens(std::move(traits), clock) {}
  sim::devices::LensConnect lens;
  std::atomic<bool> plugged{true};
};

template <class ItsClock>
class TransportOn final : public drivers::lensconnect::Transport {
 public:
  TransportOn(std::shared_ptr<ModelLens> model, ItsClock& clock) : model_(std::move(model)), clock_(clock) {}

  Result<void> Write(std::span<const std::uint8_t> report) override {
    clock_.Advance(kFrame);
    if (!model_->plugged) return Gone();
    model_->lens.Output(report);
    return {};
  }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    const Instant until = clock_.Now() + patience;
    for (;;) {
      if (!model_->plugged) return PassOn(Gone().error());
      if (interrupted_.exchange(false)) return Fail(Code::Cancelled, "interrupted");
      if (const auto report = model_->lens.TakeInput()) {
        const std::size_t count = std::min(buffer.size(), report->size());
        std::copy_n(report->begin(), count, buffer.begin());
        return count;
      }
      if (clock_.Now() >= until) return std::size_t{0};
      const auto next = model_->lens.NextInput();
      clock_.AdvanceTo(std::min(until, next.value_or(until)));
    }
  }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override {
    if (!model_->plugged) return Gone();
    model_->lens.SetFeature(report);
    return {};
  }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override {
    if (!model_->plugged) return PassOn(Gone().error());
    const auto report = model_->lens.GetFeature(buffer[0]);
    std::copy_n(report.begin(), std::min(report.size(), buffer.size()), buffer.begin());
    return report.size();
  }
  void Interrupt() override { interrupted_ = true; }
  void BeginCall() override { interrupted_ = false; }

 private:
  static constexpr Duration kFrame = std::chrono::microseconds(250);
  static Result<void> Gone() { return Fail(Code::Disconnected, "unplugged"); }

  std::shared_ptr<ModelLens> model_;
  ItsClock& clock_;
  std::atomic<bool> interrupted_{false};
};
using ModelTransport = TransportOn<SteppedClock>;

}  // namespace lensd::testing
