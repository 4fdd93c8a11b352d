// Devices: every driver's search, on a thread of its own because some ask the network.
#include <utility>

#include "daemon/methods/device_search.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/threads/task_thread.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

/// As far as serial numbers tell.
std::optional<DeviceUser> UserOf(const LensService& service, std::string_view driver, std::string_view serial) {
  for (const auto& lens : service.lenses()) {
    if (!lens->status().connected) continue;
    const auto info = varlink::ParseJson(lens->info());
    const auto is_it = [&](const Json& part) { return part["driver"] == driver && part["serial"] == serial; };
    if (!info) continue;
    const bool drives_lens = is_it(*info);
    const bool takes_pictures = (*info)["camera"].is_object() && is_it((*info)["camera"]);
    if (drives_lens || takes_pictures) return DeviceUser{lens->name(), drives_lens};
  }
  return std::nullopt;
}

/// Callers that come while a search is going on share its answer.
class SharedSearch {
 public:
  explicit SharedSearch(LensService& service) : service_(service) {}

  void Serve(const ExchangePointer& exchange) {
    waiting_.push_back(exchange);
    if (waiting_.size() > 1) return;
    thread_.Submit([this] {
      service_.loop().Post([this, search = SearchDevices()] {
        const std::string reply = DevicesReply(search, [this](std::string_view driver, std::string_view serial) {
          return UserOf(service_, driver, serial);
        });
        for (const ExchangePointer& waiting : std::exchange(waiting_, {})) waiting->Finish(reply);
      });
    });
  }

 private:
  LensService& service_;
  std::vector<ExchangePointer> waiting_;
  TaskThread thread_;
};

}  // namespace

MethodTable DeviceMethods(LensService& service) {
  return {{"Devices", [search = std::make_shared<SharedSearch>(service)](const ExchangePointer& exchange) {
             search->Serve(exchange);
           }}};
}

}  // namespace lensd::daemon
