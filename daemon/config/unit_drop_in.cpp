// What the configured drivers open, as systemd names classes of devices.
#include "daemon/config/unit_drop_in.h"

#include <set>
#include <string_view>

#include "daemon/config/drivers_table.h"

namespace lensd::daemon {
namespace {

void Add(const DeviceConfig& device, std::set<std::string_view>& classes) {
  const DriverNeeds& needs = NeedsOf(device.driver->name);
  classes.insert(needs.classes.begin(), needs.classes.end());
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
