// sim-uvc: a simulated USB camera in this machine's USB stack, until it is told to stop. What goes wrong, and when, is
// said on standard input, one line at a time.
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "sim/devices/uvc_camera.h"

namespace {

using lensd::sim::devices::StreamFaults;
using lensd::sim::devices::UvcCamera;
using lensd::sim::devices::UvcFaults;
using lensd::sim::devices::UvcOptions;

constexpr const char* kUsage =
    "usage: sim-uvc SCENE.toml [--serial TEXT] [--isochronous] [--asynchronous] [--echo] [--relative] [--auto-off]\n"
    "Plugs a simulated USB camera with a lens into this machine (needs root and the module vhci_hcd).\n"
    "  --isochronous   stream over an isochronous endpoint instead of a bulk one\n"
    "  --asynchronous  focus settings return at once and end with a status event\n"
    "  --echo          reading back tells the last setting instead of where the lens is\n"
    "  --relative      focus knows only nearer, farther and stop\n"
    "  --auto-off      automatic focus and exposure are off when plugged in\n"
    "Standard input, a line each: stall N [CODE], ignore N, lose N, late N MS, shorten N, flag N, drop N, garble N,\n"
    "plug, unplug, where, quit. It ends with its input.\n";

/// False: not understood.
bool Obey(UvcCamera& camera, const std::string& line) {
  std::istringstream words(line);
  std::string what;
  int count = 0;
  words >> what;
  const bool counted = static_cast<bool>(words >> count);
  int more = 0;
  const bool has_more = static_cast<bool>(words >> more);
  UvcFaults faults;
  StreamFaults stream;
  if (what == "unplug") {
    camera.Unplug();
  } else if (what == "plug") {
    if (auto plugged = camera.Plug(); !plugged) std::cerr << "sim-uvc: " << plugged.error().message << "\n";
  } else if (what == "where") {
    const auto state = camera.truth()->Now();
    std::cout << "focus " << state.focus_steps << " f-number " << state.f_number << " vergence " << state.focal_plane_d
              << std::endl;
  } else if (counted &&
             (what == "stall" || what == "ignore" || what == "lose" || what == "late" || what == "shorten")) {
    if (what == "stall") faults.stall = count;
    if (what == "stall" && has_more) faults.error = static_cast<std::uint8_t>(more);
    if (what == "ignore") faults.ignore = count;
    if (what == "lose") faults.lose = count;
    if (what == "late") faults.late = count;
    if (what == "late" && has_more) faults.delay = std::chrono::milliseconds(more);
    if (what == "shorten") faults.shorten = count;
    camera.SetFaults(faults);
  } else if (counted && (what == "flag" || what == "drop" || what == "garble")) {
    (what == "flag" ? stream.flagged : what == "drop" ? stream.dropped : stream.garbled) = count;
    camera.SetFaults(stream);
  } else {
    return false;
  }
  return true;
}

/// The scene's path; empty: the command line is wrong.
std::string ReadArguments(int argc, char** argv, UvcOptions& options) {
  std::string scene;
  const std::map<std::string, bool*> flags = {{"--isochronous", &options.isochronous},
                                              {"--asynchronous", &options.asynchronous},
                                              {"--echo", &options.echo},
                                              {"--relative", &options.relative_only}};
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (const auto flag = flags.find(argument); flag != flags.end()) {
      *flag->second = true;
    } else if (argument == "--auto-off") {
      options.auto_at_start = false;
    } else if (argument == "--serial" && i + 1 < argc) {
      options.serial = argv[++i];
    } else if (scene.empty() && !argument.starts_with("-")) {
      scene = argument;
    } else {
      return "";
    }
  }
  return scene;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && (std::string(argv[1]) == "--help" || std::string(argv[1]) == "-h")) {
    std::cout << kUsage;
    return 0;
  }
  UvcOptions options;
  const std::string scene_path = ReadArguments(argc, argv, options);
  if (scene_path.empty()) {
    std::cerr << kUsage;
    return 64;
  }
  auto scene = lensd::sim::LoadScene(scene_path);
  if (!scene) {
    std::cerr << "sim-uvc: " << scene.error().message << "\n";
    return 65;
  }
  const lensd::MonotonicClock clock;
  auto camera = UvcCamera::Create(std::make_shared<const lensd::sim::Scene>(*std::move(scene)), clock, options);
  auto plugged = camera ? (*camera)->Plug() : lensd::Result<void>(PassOn(camera));
  if (!plugged) {
    std::cerr << "sim-uvc: " << plugged.error().message << "\n";
    return 69;
  }
  std::cout << "plugged in" << std::endl;
  for (std::string line; std::getline(std::cin, line) && line != "quit";) {
    if (!line.empty() && !Obey(**camera, line)) std::cerr << "sim-uvc: not understood: " << line << "\n";
  }
  return 0;
}
