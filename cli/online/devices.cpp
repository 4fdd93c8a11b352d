// devices.
#include <CLI/CLI.hpp>

#include "cli/online/commands.h"
#include "cli/online/link.h"

namespace lensd::cli {
namespace {

using proto::Json;

std::string DeviceText(const Json& device) {
  const auto text = [&](const char* key) { return device.value(key, ""); };
  std::string line = text("driver") + ": " + text("model");
  if (!text("serial").empty()) line += ", serial " + text("serial");
  if (!text("node").empty()) line += ", " + text("node");
  line += device.value("lens", false) ? device.value("camera", false) ? ", lens and camera" : ", lens" : ", camera";
  if (device["usedBy"].is_string()) line += ", used by " + device["usedBy"].get<std::string>();
  if (device["problem"].is_string()) line += "\n  cannot be opened: " + device["problem"].get<std::string>();
  line += "\n";
  const std::string config = text("config");
  for (std::size_t at = 0; at < config.size();) {
    const std::size_t end = std::min(config.find('\n', at), config.size());
    line += "    " + config.substr(at, end - at) + "\n";
    at = end + 1;
  }
  return line;
}

Outcome Devices(Session& session) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  auto reply = link->Ask(MethodOfLens("Devices"), Json::object());
  if (!reply) return std::unexpected(reply.error());
  for (const Json& failed : (*reply)["failed"]) {
    session.Remark("driver " + failed.value("driver", "") + " could not search: " + failed.value("message", ""));
  }
  const Json& devices = (*reply)["devices"];
  if (session.json()) {
    session.PrintJson(devices);
    return Exit::Done;
  }
  for (const Json& device : devices) session.PrintText(DeviceText(device));
  if (devices.empty()) session.PrintText("nothing is plugged in that a driver knows; see docs/drivers");
  return Exit::Done;
}

}  // namespace

void AddDevices(CLI::App& root, Run& run) {
  auto* command =
      root.add_subcommand("devices", "what is plugged in, which driver would take it, and its configuration");
  command->group(kOnline);
  command->callback([&run] { run = Devices; });
}

}  // namespace lensd::cli
