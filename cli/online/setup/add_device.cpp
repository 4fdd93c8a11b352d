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

constexpr int kAskedAtMost = 3;  ///< times: whoever has given three wrong answers needs the documents

/// Drivers whose cameras do not report how large their pixels are.
bool ReportsPixel(const std::string& driver) {
  return driver != "v4l2" && driver != "uvc";
}

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

std::string DeviceTable(const Json& devices) {
  std::string text;
  int number = 0;
  for (const Json& device : devices) text += std::to_string(++number) + "  " + DeviceLine(device) + "\n";
  return text;
}

/// The found device of this number, to be had.
std::expected<Json, Failure> DeviceOf(const Json& devices, int number, const char* what) {
  if (number < 1 || static_cast<std::size_t>(number) > devices.size()) {
    return Refuse(Exit::NotFound, "there is no " + std::string(what) + " " + std::to_string(number) + ": " +
                                      std::to_string(devices.size()) + " found\n" + DeviceTable(devices));
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
  const std::string list = DeviceTable(devices);
  if (SomebodyIsThere(session) && !devices.empty()) {
    std::fputs(list.c_str(), stderr);
    for (int asked = 1;; ++asked) {
      std::fputs("number of the device: ", stderr);
      std::string text;
      if (!std::getline(std::cin, text)) return Refuse(Exit::Usage, "no device was chosen; nothing was added");
      auto device = DeviceOf(devices, std::atoi(text.c_str()), "device");
      if (device || asked == kAskedAtMost) return device;
      std::fprintf(stderr, "%s\n", device.error().message.c_str());
    }
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

std::expected<std::string, Failure> AnsweredLine(
    const Session& session, const std::string& given, const Question& question,
    const std::function<Result<std::string>(const std::string&)>& line_of) {
  const auto line = [&](const std::string& text) {
    return text == kUnknown ? Result<std::string>(std::string()) : line_of(text);
  };
  if (!given.empty()) {
    auto said = line(given);
    if (!said) return PassOn(said);
    return *std::move(said);
  }
  if (!SomebodyIsThere(session)) {
    return Refuse(Exit::Usage, std::string(question.text) + " of this lens: say " + question.option + " " +
                                   question.example + ", or " + question.option + " " + kUnknown +
                                   "; --model MODEL names a lens of docs/lenses.md");
  }
  for (int asked = 1;; ++asked) {
    std::fprintf(stderr, "%s, as in %s, or %s: ", question.text, question.example, kUnknown);
    std::string text;
    if (!std::getline(std::cin, text)) return Refuse(Exit::Usage, "the answers ended; nothing was added");
    auto said = line(text);
    if (said) return *std::move(said);
    if (asked == kAskedAtMost) return PassOn(said);
    std::fprintf(stderr, "%s\n", said.error().message.c_str());
  }
}

std::expected<AddedDevice, Failure> AddDevice(const Session& session, const AddOptions& options, const Json& devices,
                                              NewLens& lens) {
  std::string model = options.driver, bus = options.bus, driver = options.driver;
  bool takes_pictures = options.driver == "aravis" || options.driver == "v4l2" || options.driver == "uvc";
  if (options.driver.empty() && (bus.empty() || options.number != 0)) {
    auto device = ChooseDevice(session, devices, options.number);
    if (!device) return PassOn(device);
    model = TextOf(*device, "model");
    takes_pictures = device->value("camera", false);
    driver = TextOf(*device, "driver");
    if (driver == "modbus")
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
    driver = TextOf(*camera, "driver");
    takes_pictures = true;
  }
  const bool given = !options.pixel.empty() && options.pixel != kUnknown;
  if (given && !takes_pictures) return Refuse(Exit::Usage, "--pixel: this lens has no camera");
  return AddedDevice{ProposedName(model), takes_pictures, ReportsPixel(driver)};
}

std::expected<void, Failure> AddPixel(const Session& session, const AddOptions& options, const AddedDevice& device,
                                      NewLens& lens) {
  const bool asks = device.takes_pictures && !device.reports_pixel && SomebodyIsThere(session);
  if (options.pixel.empty() && !asks) return {};
  const auto line =
      AnsweredLine(session, options.pixel, {"--pixel", "size of a pixel of its camera", "3um"}, PixelLine);
  if (!line) return PassOn(line);
  (lens.camera.empty() ? lens.keys : lens.camera) += *line;
  return {};
}

}  // namespace lensd::cli
