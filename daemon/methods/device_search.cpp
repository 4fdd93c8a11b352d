// Asks every driver what is plugged in, and writes it as the interface's Devices reply. The daemon does so when it is
// asked to; lensd --devices does it alone.
#include "daemon/methods/device_search.h"

#include <algorithm>
#include <utility>

#include "daemon/config/config.h"
#include "daemon/config/drivers_table.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

/// A section to paste. `name` is only a proposal.
std::string ConfigOf(const DeviceSearch::Found& found, const std::string& name) {
  std::string keys = "driver = \"" + std::string(found.driver) + "\"\n" + found.device.config;
  if (keys.back() != '\n') keys += '\n';
  const bool only_camera = found.device.camera && !found.device.lens;
  return only_camera ? "[lens.camera]\n" + keys : "[[lens]]\nname = \"" + name + "\"\n" + keys;
}

}  // namespace

DeviceSearch SearchDevices() {
  DeviceSearch search;
  for (const drivers::Driver& driver : Drivers()) {
    if (driver.probe == nullptr) continue;
    auto found = driver.probe();
    if (!found) search.failed.push_back({{"driver", driver.name}, {"message", found.error().message}});
    if (!found) continue;
    for (drivers::FoundDevice& device : *found) search.found.push_back({driver.name, std::move(device)});
  }
  return search;
}

std::string DevicesReply(const DeviceSearch& search, const UserOfDevice& user_of) {
  Json devices = Json::array();
  int lenses = 0;
  for (DeviceSearch::Found found : search.found) {
    drivers::FoundDevice& device = found.device;
    const auto alike = std::ranges::count_if(search.found, [&](const DeviceSearch::Found& other) {
      return other.driver == found.driver && other.device.serial == device.serial;
    });
    const auto user = alike == 1 && !device.serial.empty() ? user_of(found.driver, device.serial) : std::nullopt;
    // A camera that is in use may not tell a search about its lens.
    if (user && user->drives_lens) device.lens = true;
    if (device.lens) ++lenses;
    devices.push_back({{"driver", found.driver},
                       {"model", device.model},
                       {"serial", TextOrNull(device.serial)},
                       {"node", TextOrNull(device.node)},
                       {"lens", device.lens},
                       {"camera", device.camera},
                       {"config", ConfigOf(found, user ? user->lens : "lens-" + std::to_string(lenses))},
                       {"problem", TextOrNull(device.problem)},
                       {"usedBy", user ? Json(user->lens) : Json(nullptr)}});
  }
  return varlink::WriteJson({{"devices", std::move(devices)},
                             {"failed", search.failed},
                             {"configuration", TextOrNull(NamedConfiguration())}});
}

}  // namespace lensd::daemon
