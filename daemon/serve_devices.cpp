// Devices: every driver's search, on a thread of its own because some ask the network.
#include <algorithm>
#include <utility>

#include "drivers_table.h"
#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"

namespace lensd::daemon {

using proto::Json;

/// What the drivers found.
struct Search {
  struct Found {
    std::string_view driver;
    drivers::FoundDevice device;
  };
  std::vector<Found> found;
  Json failed = Json::array();
};

namespace {

Search SearchAll() {
  Search search;
  for (const drivers::Driver& driver : Drivers()) {
    if (driver.probe == nullptr) continue;
    auto found = driver.probe();
    if (!found) search.failed.push_back({{"driver", driver.name}, {"message", found.error().message}});
    if (!found) continue;
    for (drivers::FoundDevice& device : *found) search.found.push_back({driver.name, std::move(device)});
  }
  return search;
}

/// A section to paste; the name is only a proposal.
std::string ConfigOf(const Search::Found& found, int number) {
  const std::string driver = "driver = \"" + std::string(found.driver) + "\"\n";
  if (!found.device.lens) return "[lens.camera]\n" + driver + found.device.config;
  return "[[lens]]\nname = \"lens-" + std::to_string(number) + "\"\n" + driver + found.device.config;
}

}  // namespace

/// Callers that come while a search is going on share its answer.
void LensService::Devices(const ExchangePointer& exchange) {
  searchers_.push_back(exchange);
  if (searchers_.size() > 1) return;
  searches_.Submit([this] {
    loop_.Post([this, search = SearchAll()] {
      const std::string reply = DevicesReply(search);
      for (const ExchangePointer& waiting : std::exchange(searchers_, {})) waiting->Finish(reply);
    });
  });
}

std::string LensService::DevicesReply(const Search& search) const {
  Json devices = Json::array();
  int lenses = 0;
  for (const Search::Found& found : search.found) {
    const drivers::FoundDevice& device = found.device;
    const auto alike = std::ranges::count_if(search.found, [&](const Search::Found& other) {
      return other.driver == found.driver && other.device.serial == device.serial;
    });
    const auto user = alike == 1 ? UserOf(found.driver, device.serial) : std::nullopt;
    devices.push_back({{"driver", found.driver},
                       {"model", device.model},
                       {"serial", device.serial},
                       {"node", device.node},
                       {"lens", device.lens},
                       {"camera", device.camera},
                       {"config", ConfigOf(found, device.lens ? ++lenses : lenses)},
                       {"problem", device.problem.empty() ? Json(nullptr) : Json(device.problem)},
                       {"usedBy", user ? Json(*user) : Json(nullptr)}});
  }
  return proto::WriteJson({{"devices", std::move(devices)}, {"failed", search.failed}});
}

/// The lens that has it open, as far as serial numbers tell.
std::optional<std::string> LensService::UserOf(std::string_view driver, std::string_view serial) const {
  if (serial.empty()) return std::nullopt;
  for (const auto& lens : lenses_) {
    if (!lens->status->connected) continue;
    const auto info = proto::ParseJson(lens->info);
    const auto is_it = [&](const Json& part) { return part["driver"] == driver && part["serial"] == serial; };
    if (info && (is_it(*info) || ((*info)["camera"].is_object() && is_it((*info)["camera"])))) return lens->name;
  }
  return std::nullopt;
}

}  // namespace lensd::daemon
