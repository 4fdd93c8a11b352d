// Exposure time and gain of a capture node, where its driver has controls for them.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include "controls.h"
#include "drivers/api/camera.h"
#include "drivers/api/device.h"

namespace lensd::drivers::v4l2 {

/// The automatisms that would set them back are switched off first, and stay so while the device is open. One thread.
class ImageControls {
 public:
  /// What cannot be used is left out. Errors of the whole device.
  static Result<ImageControls> Find(std::shared_ptr<const Node> node, std::shared_ptr<Automatics> automatics,
                                    drivers::Findings& findings);

  /// What can be set, and from where to where.
  void Describe(drivers::CameraCapabilities& can) const;
  /// Both round to what the control takes. OutOfRange: the device has taken another value. Busy: another program has
  /// switched an automatism on. Unsupported: there is no such control.
  Result<void> SetExposure(Duration exposure);
  Result<void> SetGain(double gain);
  /// As the device says; nothing of what it does not say, or what an automatism keeps to itself.
  Result<drivers::ExposureState> Read() const;
  /// As the device has confirmed it; nothing: never set.
  std::optional<Duration> exposure() const { return exposure_; }

 private:
  ImageControls(std::shared_ptr<const Node> node, std::shared_ptr<Automatics> automatics)
      : node_(std::move(node)), automatics_(std::move(automatics)) {}
  /// The first of `ids` that can be used.
  Result<std::optional<Control>> FirstOf(std::initializer_list<std::uint32_t> ids, const std::string& part,
                                         drivers::Findings& findings) const;
  /// What the control has then.
  Result<std::int64_t> Set(const Control& control, double value);
  /// Nothing: it does not say, or what it says has no effect now.
  Result<std::optional<std::int64_t>> Ask(const std::optional<Control>& control) const;

  std::shared_ptr<const Node> node_;
  std::shared_ptr<Automatics> automatics_;
  std::optional<Control> exposure_control_;
  std::optional<Control> gain_control_;
  std::optional<Duration> exposure_;
};

}  // namespace lensd::drivers::v4l2
