// What each driver opens, as systemd names classes of devices.
#include "daemon/config/unit_drop_in.h"

#include <algorithm>
#include <set>
#include <span>
#include <string_view>
#include <vector>

namespace lensd::daemon {
namespace {

struct Needs {
  std::string_view driver;
  std::vector<std::string_view> classes;
};

const std::vector<Needs>& Table() {
  static const std::vector<Needs> table = {{"sim", {}},
                                           {"v4l2", {"char-video4linux", "char-media", "char-i2c"}},
                                           {"uvc", {"char-usb_device"}},
                                           {"lensconnect", {"char-hidraw"}},
                                           {"modbus", {"char-ttyS", "char-ttyUSB", "char-ttyACM"}},
                                           {"aravis", {"char-usb_device"}}};
  return table;
}

void Add(const DeviceConfig& device, std::set<std::string_view>& classes) {
  const auto found = std::ranges::find(Table(), device.driver->name, &Needs::driver);
  if (found != Table().end()) classes.insert(found->classes.begin(), found->classes.end());
}

}  // namespace

std::string UnitDropIn(const Config& config, const std::string& file) {
  std::set<std::string_view> classes;
  for (const LensConfig& lens : config.lenses) {
    Add(lens.device, classes);
    if (lens.camera) Add(*lens.camera, classes);
  }
  std::string text = "# By lensd --print-unit-drop-in, for the drivers of " + file +
                     ". Print it again when another driver is configured.\n[Service]\nDeviceAllow=\n";
  for (const std::string_view name : classes) text += "DeviceAllow=" + std::string(name) + " rw\n";
  return text;
}

}  // namespace lensd::daemon
