// A camera that forwards to another one and goes wrong on demand.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/api/camera.h"

namespace lensd::testing {

/// Faults may be set and cleared from any thread, at any time.
class FaultyCamera final : public drivers::Camera {
 public:
  explicit FaultyCamera(std::unique_ptr<drivers::Camera> inner)
      : Camera(inner->capabilities()), inner_(std::move(inner)) {}

  /// Every call fails with Disconnected while it is off.
  void SetConnected(bool connected) {
    const std::lock_guard lock(mutex_);
    connected_ = connected;
  }
  /// The next `count` frames never arrive.
  void LoseFrames(int count) {
    const std::lock_guard lock(mutex_);
    lost_ = count;
  }
  /// Frames repeat the last picture under new times while it is on.
  void SetFrozen(bool frozen) {
    const std::lock_guard lock(mutex_);
    frozen_ = frozen;
  }
  /// Multiplies every sample, clipped: an exposure other than the one reported. 1: right.
  void SetBrightness(double factor) {
    const std::lock_guard lock(mutex_);
    brightness_ = factor;
  }
  /// The next `count` polls time out.
  void TimeOutPolls(int count) {
    const std::lock_guard lock(mutex_);
    timeouts_ = count;
  }

 private:
  using Samples = std::vector<std::uint16_t>;

  Result<void> DoStart() override { return connected() ? inner_->Start() : Gone(); }
  Result<void> DoStop() override { return connected() ? inner_->Stop() : Gone(); }
  Result<void> DoSetExposure(Duration exposure) override {
    return connected() ? inner_->SetExposure(exposure) : Gone();
  }
  Result<void> DoSetGain(double gain) override { return connected() ? inner_->SetGain(gain) : Gone(); }
  Result<drivers::ExposureState> DoReadExposure() override {
    if (!connected()) return PassOn(Gone());
    return inner_->ReadExposure();
  }
  void DoInterrupt() override { inner_->Interrupt(); }

  Result<std::optional<drivers::Frame>> DoPoll() override {
    const std::lock_guard lock(mutex_);
    if (!connected_) return PassOn(Gone().error());
    if (timeouts_ > 0) {
      --timeouts_;
      return Fail(Code::Timeout, "the camera did not answer in time");
    }
    auto frame = inner_->Poll();
    if (!frame || !*frame) return frame;
    if (lost_ > 0) {
      --lost_;
      return std::optional<drivers::Frame>();
    }
    if (frozen_ && last_) (*frame)->samples = last_;
    last_ = (*frame)->samples;
    if (brightness_ != 1.0) (*frame)->samples = Scaled(**frame);
    return frame;
  }

  bool connected() const {
    const std::lock_guard lock(mutex_);
    return connected_;
  }
  std::shared_ptr<const Samples> Scaled(const drivers::Frame& frame) const {
    const double top = (1 << frame.bits) - 1;
    auto scaled = std::make_shared<Samples>(*frame.samples);
    for (auto& sample : *scaled) sample = static_cast<std::uint16_t>(std::min(top, sample * brightness_ + 0.5));
    return scaled;
  }
  static Result<void> Gone() { return Fail(Code::Disconnected, "the camera is unplugged"); }

  const std::unique_ptr<drivers::Camera> inner_;
  mutable std::mutex mutex_;
  bool connected_ = true;
  bool frozen_ = false;
  int lost_ = 0;
  int timeouts_ = 0;
  double brightness_ = 1.0;
  std::shared_ptr<const Samples> last_;
};

}  // namespace lensd::testing
