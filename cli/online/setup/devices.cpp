// devices: what the daemon finds plugged in, or without one what lensd's program finds, and a configuration for it.
#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <set>

#include "cli/link/daemon_client.h"
#include "cli/link/daemon_program.h"
#include "cli/online/commands.h"
#include "cli/online/setup/devices.h"
#include "cli/text/texts.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

using varlink::Json;

std::string DeviceText(const Json& device) {
  std::string line = DeviceLine(device) + "\n";
  const std::string config = TextOf(device, "config");
  for (std::size_t at = 0; at < config.size();) {
    const std::size_t end = std::min(config.find('\n', at), config.size());
    line += "    " + config.substr(at, end - at) + "\n";
    at = end + 1;
  }
  return line;
}

/// The daemon's answer; where none runs, that of lensd's program.
std::expected<Json, Failure> FindDevices(Session& session) {
  auto link = DaemonClient::Open(session);
  if (link) return link->Ask(MethodOfLens("Devices"), Json::object(), kDeviceSearch);
  if (link.error().status != Exit::Unavailable) return PassOn(link);
  const ProgramEnd end = RunDaemonProgram({"--devices"}, STDOUT_FILENO);
  if (end.status == 127) {
    return Refuse(Exit::Unavailable, link.error().message + "; and lensd is not installed here to look without it");
  }
  auto reply = varlink::ParseJson(end.said);
  if (end.status != 0 || !reply) {
    return Refuse(Exit::Internal, "lensd --devices failed with status " + std::to_string(end.status));
  }
  session.Remark("no daemon answers: lensd --devices has looked instead");
  return *std::move(reply);
}

/// The lenses found, ready for lensd; what needs a decision stands in comments.
std::string Configuration(const Json& devices) {
  std::string file = "version = 1\n";
  std::set<std::string> serials;
  for (const Json& device : devices) {
    const std::string serial = TextOf(device, "serial");
    const bool again = !serial.empty() && !serials.insert(serial).second;
    const bool lens = device.value("lens", false);
    std::string model = device.value("model", "");  // as the device writes it
    std::ranges::replace_if(model, [](unsigned char letter) { return letter < ' '; }, ' ');
    file += "\n# " + model;
    if (again) {
      file += ": found by the driver above already; use one of them";
    } else if (device.value("camera", false) && !lens) {
      file += ": a camera without a lens; belongs after the [[lens]] it looks through";
    }
    file += "\n";
    const std::string keys = device.value("config", "");
    for (std::size_t at = 0; at < keys.size();) {
      const std::size_t end = std::min(keys.find('\n', at), keys.size());
      file += (lens && !again ? "" : "# ") + keys.substr(at, end - at) + "\n";
      at = end + 1;
    }
  }
  return file;
}

/// A file that is there already is the user's work and stays.
std::expected<void, Failure> WriteNew(const std::string& path, const std::string& text) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0 && errno == EEXIST) {
    return Refuse(Exit::CannotWrite, path + " is there already: remove it or name another file");
  }
  if (file < 0) return Refuse(Exit::CannotWrite, path + ": " + std::strerror(errno));
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (close(file) == 0 && written) return {};
  unlink(path.c_str());
  return Refuse(Exit::CannotWrite, path + ": " + std::strerror(errno));
}

Outcome Devices(Session& session, const std::string& file) {
  auto reply = FindDevices(session);
  if (!reply) return PassOn(reply);
  for (const Json& failed : (*reply)["failed"]) {
    session.Remark("driver " + failed.value("driver", "") + " could not search: " + failed.value("message", ""));
  }
  const Json& devices = (*reply)["devices"];
  if (file == "-") {  // the configuration is all that is printed
    session.PrintText(Configuration(devices));
    return Exit::Done;
  }
  if (!file.empty()) {
    if (auto written = WriteNew(file, Configuration(devices)); !written) return PassOn(written);
    session.Remark("wrote " + file + "; lensd --check-config --config " + file + " tries it");
  }
  if (session.json()) {
    session.PrintJson(devices);
    return Exit::Done;
  }
  for (const Json& device : devices) session.PrintText(DeviceText(device));
  if (devices.empty()) session.PrintText("nothing is plugged in that a driver knows; see docs/drivers");
  return Exit::Done;
}

}  // namespace

std::string DeviceLine(const Json& device) {
  const auto text = [&](const char* key) { return TextOf(device, key); };
  std::string line = text("driver") + ": " + text("model");
  if (!text("serial").empty()) line += ", serial " + text("serial");
  if (!text("node").empty()) line += ", " + text("node");
  const bool lens = device.value("lens", false);
  const bool camera = device.value("camera", false);
  if (lens || camera) line += lens && camera ? ", lens and camera" : lens ? ", lens" : ", camera";
  if (device["usedBy"].is_string()) line += ", used by " + device["usedBy"].get<std::string>();
  if (device["problem"].is_string()) line += "\n  cannot be opened: " + device["problem"].get<std::string>();
  return line;
}

void AddDevices(CLI::App& root, Run& run) {
  auto* command =
      root.add_subcommand("devices", "list what is plugged in, the driver that fits, and its configuration");
  command->group(kOnline);
  auto file = std::make_shared<std::string>();
  command
      ->add_option("--write-config", *file, "write a configuration with every lens found to this new file; - prints it")
      ->type_name("FILE");
  command->callback([&run, file] { run = [file](Session& session) { return Devices(session, *file); }; });
}

}  // namespace lensd::cli
