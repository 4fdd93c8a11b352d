// What is in use already, or cannot be opened, is refused before anything is written.
#include "cli/online/setup/add_device.h"

#include <unistd.h>

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "cli/online/setup/add_lines.h"
#include "cli/online/setup/devices.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// The keys of a found device, without the head that `devices` proposes.
std::string KeysOf(const Json& device) {
  const std::string config = TextOf(device, "config");
  const std::size_t driver = config.find("driver = ");
  std::string keys = driver == std::string::npos ? "" : config.substr(driver);
  if (!keys.empty() && keys.back() != '\n') keys += '\n';
  return keys;
}

std::string ProposedName(const std::string& model) {
  std::string name;
  for (const unsigned char letter : model) {
    if (isalnum(letter) != 0)
      name += static_cast<char>(tolower(letter));
    else if (!name.empty() && name.back() != '-')
      name += '-';
  }
  while (!name.empty() && name.back() == '-') name.pop_back();
  return name.empty() || isalpha(static_cast<unsigned char>(name[0])) == 0 ? "lens" : name;
}

std::string ListText(const Json& devices) {
  std::string text;
  int number = 0;
  for (const Json& device : devices) text += std::to_string(++number) + "  " + DeviceLine(device) + "\n";
  return text;
}

/// The found device of this number, to be had.
std::expected<Json, Failure> DeviceOf(const Json& devices, int number, const char* what) {
  if (number < 1 || static_cast<std::size_t>(number) > devices.size()) {
    return Refuse(Exit::NotFound, "there is no " + std::string(what) + " " + std::to_string(number) + ": " +
                                      std::to_string(devices.size()) + " found\n" + ListText(devices));
  }
  Json device = devices[static_cast<std::size_t>(number) - 1];
  if (device["usedBy"].is_string()) {
    return Refuse(Exit::Usage, TextOf(device, "model") + " is in use already, by " + TextOf(device, "usedBy"));
  }
  if (device["problem"].is_string()) {
    return Refuse(Exit::Unavailable, TextOf(device, "model") + " cannot be opened: " + TextOf(device, "problem"));
  }
  return device;
}

/// The device that is meant: by its number, the only lens that is not in use, or by asking.
std::expected<Json, Failure> ChooseDevice(const Session& session, const Json& devices, int number) {
  if (number != 0) return DeviceOf(devices, number, "device");
  std::vector<int> lenses;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (devices[i].value("lens", false) && !devices[i]["usedBy"].is_string()) lenses.push_back(static_cast<int>(i) + 1);
  }
  const std::string list = ListText(devices);
  if (SomebodyIsThere(session) && !devices.empty()) {
    std::fprintf(stderr, "%snumber of the device: ", list.c_str());
    std::string text;
    if (!std::getline(std::cin, text)) return Refuse(Exit::Usage, "no device was chosen; nothing was added");
    return DeviceOf(devices, std::atoi(text.c_str()), "device");
  }
  if (lenses.size() == 1) return DeviceOf(devices, lenses[0], "device");
  if (lenses.empty()) {
    return Refuse(Exit::NotFound,
                  "no lens is found that is not in use; --driver and --set name one that no search "
                  "finds (docs/drivers), --bus and --drive one on Modbus\n" +
                      list);
  }
  return Refuse(Exit::Usage, "which one? say its number, as in lensctl add " + std::to_string(lenses[0]) + "\n" + list);
}

}  // namespace

bool SomebodyIsThere(const Session& session) {
  return !session.json() && isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
}

std::expected<std::string, Failure> AddDevice(const Session& session, const AddOptions& options, const Json& devices,
                                              NewLens& lens) {
  std::string model = options.driver, bus = options.bus;
  bool takes_pictures = options.driver == "aravis" || options.driver == "v4l2" || options.driver == "uvc";
  if (options.driver.empty() && (bus.empty() || options.number != 0)) {
    auto device = ChooseDevice(session, devices, options.number);
    if (!device) return PassOn(device);
    model = TextOf(*device, "model");
    takes_pictures = device->value("camera", false);
    if (TextOf(*device, "driver") == "modbus")
      bus = TextOf(*device, "node");
    else
      lens.keys = KeysOf(*device);
  } else if (!options.driver.empty() && options.driver != "modbus") {
    lens.keys = "driver = " + QuotedToml(options.driver) + "\n";
  }
  if (!bus.empty() || options.driver == "modbus") {
    if (bus.empty() || options.drives.empty()) {
      return Refuse(Exit::Usage,
                    "a lens on Modbus needs --bus (a serial port, or HOST:PORT) and a --drive for each axis, "
                    "as in --drive focus=1,oriental-az,0..20000");
    }
    model = "ring";
    lens.keys = "driver = \"modbus\"\nbus = @\n";
  }
  if (!bus.empty()) lens.bus = std::string(bus[0] == '/' ? "device" : "host") + " = " + QuotedToml(bus) + "\n";
  for (const std::string& one : options.keys) {
    auto line = KeyLine(one);
    if (!line) return PassOn(line);
    (bus.empty() ? lens.keys : lens.bus) += *line;
  }
  for (const std::string& one : options.drives) {
    if (bus.empty()) return Refuse(Exit::Usage, "--drive is for lenses on Modbus: say --bus too");
    auto table = DriveTable(one);
    if (!table) return PassOn(table);
    lens.tables += *table;
  }
  if (options.camera != 0) {
    auto camera = DeviceOf(devices, options.camera, "camera");
    if (!camera) return PassOn(camera);
    if (!camera->value("camera", false)) return Refuse(Exit::Usage, TextOf(*camera, "model") + " takes no pictures");
    lens.camera = KeysOf(*camera);
  }
  if (!options.pixel.empty() && options.pixel != kUnknown) {
    auto pixel = ParsePositiveLength(options.pixel, "--pixel");
    if (!pixel) return PassOn(pixel);
    if (!takes_pictures && lens.camera.empty()) return Refuse(Exit::Usage, "--pixel: this lens has no camera");
    const double um = pixel->Nearest().value_or(0.0) * 1e6;
    (lens.camera.empty() ? lens.keys : lens.camera) += "pixel_um = " + NumberTextOf(um) + "\n";
  }
  return ProposedName(model);
}

}  // namespace lensd::cli
