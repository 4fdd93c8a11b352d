// Word from udev that a device came.
#pragma once

#include <functional>
#include <memory>

#include "base/result.h"

struct sd_event;
struct sd_device_monitor;

namespace lensd::drivers::hotplug {

/// Belongs to the thread that runs the event loop. Without udev (containers, small systems) nothing is ever told: who
/// waits for a device has to look by itself now and then.
class Monitor {
 public:
  /// `came` is called in the loop after udev has dealt with a new hidraw, video4linux, media, tty or USB device, so
  /// that its node has its final permissions. `loop` must outlive the monitor. Io: the kernel refuses.
  static Result<std::unique_ptr<Monitor>> Create(sd_event* loop, std::function<void()> came);
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

 private:
  explicit Monitor(std::function<void()> came) : came_(std::move(came)) {}

  sd_device_monitor* monitor_ = nullptr;
  std::function<void()> came_;
};

}  // namespace lensd::drivers::hotplug
