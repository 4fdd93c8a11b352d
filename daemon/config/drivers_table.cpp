// Every driver there is, by name. A new one is one row.
#include "daemon/config/drivers_table.h"

#include <algorithm>

#include "drivers/aravis/driver.h"
#include "drivers/lensconnect/driver.h"
#include "drivers/modbus/driver.h"
#include "drivers/uvc/driver.h"
#include "drivers/v4l2/driver.h"
#include "sim/driver.h"

namespace lensd::daemon {
namespace {

constexpr drivers::Driver kDrivers[] = {
    {.name = "sim", .open = sim::OpenSim, .probe = nullptr, .check = sim::CheckSim, .simulated = true, .reopen = false},
    {.name = "v4l2",
     .open = drivers::v4l2::OpenV4l2,
     .probe = drivers::v4l2::ProbeV4l2,
     .check = drivers::v4l2::CheckV4l2},
    {.name = "uvc", .open = drivers::uvc::OpenUvc, .probe = drivers::uvc::ProbeUvc, .check = drivers::uvc::CheckUvc},
    {.name = "lensconnect",
     .open = drivers::lensconnect::OpenLensConnect,
     .probe = drivers::lensconnect::ProbeLensConnect,
     .check = drivers::lensconnect::CheckLensConnect},
    {.name = "modbus",
     .open = drivers::modbus::OpenModbus,
     .probe = drivers::modbus::ProbeModbus,
     .check = drivers::modbus::CheckModbus,
     .reopen = false,
     .check_bus = drivers::modbus::CheckBus,
     .profiles = &drivers::modbus::kProfiles},
    {.name = "aravis",
     .open = drivers::aravis::OpenAravis,
     .probe = drivers::aravis::ProbeAravis,
     .check = drivers::aravis::CheckAravis,
     .reopen = false},
};

}  // namespace

std::span<const drivers::Driver> Drivers() {
  return kDrivers;
}

const drivers::Driver* FindDriver(std::string_view name) {
  const auto* found = std::ranges::find(kDrivers, name, &drivers::Driver::name);
  return found == std::end(kDrivers) ? nullptr : found;
}

const DriverNeeds& NeedsOf(std::string_view driver) {
  static const std::vector<DriverNeeds> table = {
      {"v4l2", {"char-video4linux", "char-media", "char-i2c"}, {"video", "v4l-subdev", "media", "i2c-"}},
      {"uvc", {"char-usb_device"}, {"bus/usb"}},
      {"lensconnect", {"char-hidraw"}, {"hidraw"}},
      {"modbus", {"char-ttyS", "char-ttyUSB", "char-ttyACM"}, {}, true},
      {"aravis", {"char-usb_device"}, {"bus/usb"}, true}};
  static const DriverNeeds nothing;
  const auto found = std::ranges::find(table, driver, &DriverNeeds::driver);
  return found == table.end() ? nothing : *found;
}

std::string DriverNames() {
  std::string names;
  for (const drivers::Driver& driver : kDrivers) names += (names.empty() ? "" : ", ") + std::string(driver.name);
  return names;
}

std::optional<int> BeginDrivers(std::span<char*> arguments) {
  namespace aravis = drivers::aravis;
  if (arguments.size() == 3 && std::string_view(arguments[1]) == aravis::kTryUsbCamera) {
    return aravis::TryUsbCamera(arguments[2]);
  }
  aravis::TryUsbCamerasBy("/proc/self/exe");
  return std::nullopt;
}

}  // namespace lensd::daemon
