// A udev socket that becomes readable when a device comes or goes; nothing more is read from it than that.
#include "drivers/hotplug/monitor.h"

#include <systemd/sd-device.h>

#include <cstring>
#include <string>

namespace lensd::drivers::hotplug {

Result<std::unique_ptr<Monitor>> Monitor::Create(sd_event* loop, std::function<void()> came) {
  std::unique_ptr<Monitor> made(new Monitor(std::move(came)));
  int status = sd_device_monitor_new(&made->monitor_);
  for (const char* subsystem : {"hidraw", "video4linux", "media", "tty", "usb"}) {
    if (status < 0) break;
    status = sd_device_monitor_filter_add_match_subsystem_devtype(made->monitor_, subsystem, nullptr);
  }
  if (status >= 0) status = sd_device_monitor_attach_event(made->monitor_, loop);
  const auto tell = [](sd_device_monitor*, sd_device* device, void* self) {
    sd_device_action_t action = SD_DEVICE_REMOVE;
    if (sd_device_get_action(device, &action) >= 0 && action != SD_DEVICE_REMOVE && action != SD_DEVICE_UNBIND) {
      static_cast<Monitor*>(self)->came_();
    }
    return 0;
  };
  if (status >= 0) status = sd_device_monitor_start(made->monitor_, tell, made.get());
  if (status < 0) return Fail(Code::Io, std::string("cannot listen for devices: ") + std::strerror(-status));
  return made;
}

Monitor::~Monitor() {
  sd_device_monitor_unref(monitor_);
}

}  // namespace lensd::drivers::hotplug
