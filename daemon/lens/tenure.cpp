// A thread that comes back from a call it was given up for goes on with the next one: that must not reach the device,
// which another thread uses by then.
#include "daemon/lens/tenure.h"

#include <utility>

namespace lensd::daemon {
namespace {

using drivers::Axis;

/// What `call` does to the device, unless its time is over.
template <class Call>
auto Unless(const Tenure& tenure, Call call) -> decltype(call()) {
  if (tenure.over())
    return Fail(Code::Cancelled, "lensd has given up this session of the lens and opened the lens again");
  return call();
}

class TenantLens final : public drivers::Lens {
 public:
  TenantLens(std::shared_ptr<const Tenure> tenure, std::unique_ptr<drivers::Lens> lens)
      : Lens(lens->capabilities()), tenure_(std::move(tenure)), lens_(std::move(lens)) {}

 private:
  Result<void> DoStartHome(Axis axis) override {
    return Unless(*tenure_, [&] { return lens_->StartHome(axis); });
  }
  Result<void> DoStartMove(Axis axis, Native target) override {
    return Unless(*tenure_, [&] { return lens_->StartMove(axis, target); });
  }
  Result<drivers::LensState> DoRead() override {
    return Unless(*tenure_, [&] { return lens_->Read(); });
  }
  Result<void> DoStop(Axis axis) override {
    return Unless(*tenure_, [&] { return lens_->Stop(axis); });
  }
  Result<void> DoResetFault(Axis axis) override {
    return Unless(*tenure_, [&] { return lens_->ResetFault(axis); });
  }
  void DoInterrupt() override { lens_->Interrupt(); }
  void DoCutReadShort() override { lens_->CutReadShort(); }
  std::uint64_t DoCountBusErrors() const override { return lens_->bus_errors(); }

  const std::shared_ptr<const Tenure> tenure_;
  const std::unique_ptr<drivers::Lens> lens_;
};

class TenantCamera final : public drivers::Camera {
 public:
  TenantCamera(std::shared_ptr<const Tenure> tenure, std::unique_ptr<drivers::Camera> camera)
      : Camera(camera->capabilities()), tenure_(std::move(tenure)), camera_(std::move(camera)) {}

 private:
  Result<void> DoStart() override {
    return Unless(*tenure_, [&] { return camera_->Start(); });
  }
  Result<void> DoStop() override {
    return Unless(*tenure_, [&] { return camera_->Stop(); });
  }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    return Unless(*tenure_, [&] { return camera_->Poll(); });
  }
  Result<void> DoSetExposure(Duration exposure) override {
    return Unless(*tenure_, [&] { return camera_->SetExposure(exposure); });
  }
  Result<void> DoSetGain(double gain) override {
    return Unless(*tenure_, [&] { return camera_->SetGain(gain); });
  }
  Result<drivers::ExposureState> DoReadExposure() override {
    return Unless(*tenure_, [&] { return camera_->ReadExposure(); });
  }
  void DoInterrupt() override { camera_->Interrupt(); }
  drivers::Counters DoCount() const override { return camera_->counters(); }
  drivers::UnusableFrames DoTellUnusable() const override { return camera_->unusable(); }

  const std::shared_ptr<const Tenure> tenure_;
  const std::unique_ptr<drivers::Camera> camera_;
};

}  // namespace

drivers::Device Under(std::shared_ptr<const Tenure> tenure, drivers::Device device) {
  if (device.lens) device.lens = std::make_unique<TenantLens>(tenure, std::move(device.lens));
  if (device.camera) device.camera = std::make_unique<TenantCamera>(std::move(tenure), std::move(device.camera));
  return device;
}

}  // namespace lensd::daemon
