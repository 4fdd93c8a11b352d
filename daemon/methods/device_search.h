// What is plugged into this machine that a driver would take.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/api/device.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// What the drivers found.
struct DeviceSearch {
  struct Found {
    std::string_view driver;
    drivers::FoundDevice device;
  };
  std::vector<Found> found;
  varlink::Json failed = varlink::Json::array();  ///< FailedSearch of the interface
};

/// Asks every driver; takes some seconds where one asks the network. Any thread.
DeviceSearch SearchDevices();

/// Who has a device open.
struct DeviceUser {
  std::string lens;          ///< of the configuration
  bool drives_lens = false;  ///< its motors are this device's, and not only its pictures
};

/// Of the device of this driver and serial number; nothing: no lens.
using UserOfDevice = std::function<std::optional<DeviceUser>(std::string_view driver, std::string_view serial)>;

/// The reply to Devices, one line of JSON.
std::string DevicesReply(const DeviceSearch& search, const UserOfDevice& user_of);

}  // namespace lensd::daemon
