// sim-modbus-drive: drives on a Modbus wire, for trying lensd without hardware.
#include <getopt.h>
#include <poll.h>
#include <signal.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "sim/devices/modbus_bus.h"

namespace lensd::sim {
namespace {

constexpr const char* kHelp =
    R"(usage: sim-modbus-drive (--tcp PORT | --rtu LINK) [--profile NAME] [--unit N[:NAME]]... [options]

Plays stepper and servo drives on a Modbus wire. TCP is served on 127.0.0.1 (port 0: any); RTU on a pseudo-terminal that
LINK will point to. Profiles: oriental-az, moons, leadshine-rs, generic. The first line on stdout says where it listens.

  --unit N[:NAME]        a drive with number N, of the given or else the common profile (default: one drive, number 1)
  --fault KIND:P         exchanges go wrong with probability P: no-reply deaf late bad-crc short wrong-unit exception
                         split noise ignore; may be given several times
  --late MS              how late a late answer is (default 60)
  --seed N               for the faults (default 1)
  --help

Commands on standard input, one a line, answered with one line; its end leaves the simulator running:
  alarm UNIT CODE        the drive raises an alarm (0: none)      position UNIT          where it stands, in counts
  fault KIND [UNIT]      the next exchange goes wrong             ignore UNIT COUNT      motions acknowledged, not begun
  block UNIT 0|1         the motor stands still                   unplug, plug           the wire is cut, and mended
  quit
)";

struct Options {
  std::optional<int> tcp;
  std::string rtu;
  std::string profile = "oriental-az";
  std::vector<std::pair<int, std::string>> units;
  std::map<WireFault, double> faults;
  int late_ms = 60;
  unsigned long seed = 1;
};

int Misused(const std::string& why) {
  std::cerr << "sim-modbus-drive: " << why << "; --help says more\n";
  return EX_USAGE;
}

/// The whole of `text` as a number of the given range.
std::optional<double> Number(const std::string& text, double low, double high) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(number >= low && number <= high)) return std::nullopt;
  return number;
}

/// An exit status where there is nothing to serve.
std::optional<int> Parse(int argc, char** argv, Options& options) {
  static const option kLong[] = {{"tcp", required_argument, nullptr, 't'},
                                 {"rtu", required_argument, nullptr, 'r'},
                                 {"profile", required_argument, nullptr, 'p'},
                                 {"unit", required_argument, nullptr, 'u'},
                                 {"fault", required_argument, nullptr, 'f'},
                                 {"late", required_argument, nullptr, 'l'},
                                 {"seed", required_argument, nullptr, 's'},
                                 {"help", no_argument, nullptr, 'h'},
                                 {nullptr, 0, nullptr, 0}};
  std::vector<std::pair<int, std::string>> units;
  for (int which = 0; (which = getopt_long(argc, argv, "", kLong, nullptr)) != -1;) {
    const std::string value = optarg == nullptr ? "" : optarg;
    const auto colon = value.find(':');
    const std::string before = value.substr(0, colon),
                      after = colon == std::string::npos ? "" : value.substr(colon + 1);
    if (which == 'h') {
      std::cout << kHelp;
      return EX_OK;
    }
    if (which == 't') {
      const auto port = Number(value, 0, 65535);
      if (!port) return Misused("--tcp needs a port from 0 to 65535");
      options.tcp = static_cast<int>(*port);
    } else if (which == 'r') {
      options.rtu = value;
    } else if (which == 'p') {
      options.profile = value;
    } else if (which == 'u') {
      const auto unit = Number(before, 1, 247);
      if (!unit) return Misused("--unit needs a number from 1 to 247");
      units.emplace_back(static_cast<int>(*unit), after);
    } else if (which == 'f') {
      const auto fault = WireFaultFromName(before);
      const auto probability = Number(after, 0, 1);
      if (!fault || !probability) return Misused("--fault needs KIND:PROBABILITY");
      options.faults[*fault] = *probability;
    } else if (which == 'l' || which == 's') {
      const auto number = Number(value, 0, 1e9);
      if (!number) return Misused("--late and --seed need a number");
      (which == 'l' ? options.late_ms = static_cast<int>(*number) : options.seed = static_cast<unsigned long>(*number));
    } else {
      return Misused("this is not understood");
    }
  }
  if (optind < argc) return Misused(std::string("\"") + argv[optind] + "\" is not understood");
  if (options.tcp.has_value() == !options.rtu.empty()) return Misused("either --tcp or --rtu");
  if (units.empty()) units.emplace_back(1, "");
  for (auto& [unit, profile] : units) {
    if (profile.empty()) profile = options.profile;
    if (!MakeModbusDrive(profile)) return Misused("there is no profile \"" + profile + "\"");
  }
  options.units = std::move(units);
  return std::nullopt;
}

Result<std::string> Serve(ModbusBus& bus, const Options& options, std::optional<int>& port) {
  if (!options.rtu.empty()) {
    if (auto served = bus.ServeRtu(options.rtu); !served) return PassOn(served);
    return "listening on " + options.rtu;
  }
  const auto served = bus.ServeTcp(port.value_or(*options.tcp));
  if (!served) return PassOn(served);
  port = *served;
  return "listening on 127.0.0.1:" + std::to_string(*served);
}

std::string Act(ModbusBus& bus, const Options& options, const std::string& verb, std::istream& words) {
  std::string what;
  int unit = 0;
  if (verb == "fault") {
    words >> what >> unit;
    const auto fault = WireFaultFromName(what);
    if (!fault) return "error: no such fault";
    bus.Inject(*fault, unit);
    return "ok";
  }
  words >> unit >> what;
  if (std::ranges::find(options.units, unit, &std::pair<int, std::string>::first) == options.units.end()) {
    return "error: no such unit";
  }
  const auto number = static_cast<std::uint32_t>(std::strtoul(what.c_str(), nullptr, 0));
  if (verb == "position") {
    return std::to_string(
        bus.With(unit, [](ModbusDrive& drive, Duration now) { return std::llround(drive.shaft().CountAt(now)); }));
  }
  if (verb == "alarm") {
    bus.With(unit, [&](ModbusDrive& drive, Duration now) { drive.RaiseAlarm(number, now); });
  } else if (verb == "ignore") {
    bus.With(unit, [&](ModbusDrive& drive, Duration) { drive.Ignore(static_cast<int>(number)); });
  } else if (verb == "block") {
    bus.With(unit, [&](ModbusDrive& drive, Duration) { drive.Block(number != 0); });
  } else {
    return "error: no such command";
  }
  return "ok";
}

/// Reads commands until the end of the input; false: quit.
bool Obey(ModbusBus& bus, const Options& options, std::optional<int>& port) {
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string verb;
    if (!(words >> verb)) continue;
    if (verb == "quit") return false;
    if (verb == "unplug") {
      bus.Unplug();
      std::cout << "ok" << std::endl;
    } else if (verb == "plug") {
      const auto served = Serve(bus, options, port);
      std::cout << (served ? *served : "error: " + served.error().message) << std::endl;
    } else {
      std::cout << Act(bus, options, verb, words) << std::endl;
    }
  }
  return true;
}

int Main(int argc, char** argv) {
  Options options;
  if (const auto status = Parse(argc, argv, options)) return *status;
  signal(SIGPIPE, SIG_IGN);
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGTERM);
  ModbusBus bus;
  for (const auto& [unit, profile] : options.units) bus.AddDrive(unit, MakeModbusDrive(profile));
  bus.SetLate(std::chrono::milliseconds(options.late_ms));
  if (!options.faults.empty()) bus.SetRandomFaults(options.faults, options.seed);
  std::optional<int> port;
  const auto served = Serve(bus, options, port);
  if (!served) {
    std::cerr << "sim-modbus-drive: " << served.error().message << "\n";
    return EX_IOERR;
  }
  std::cout << *served << std::endl;
  if (!Obey(bus, options, port)) return EX_OK;
  sigprocmask(SIG_BLOCK, &ending, nullptr);
  int signal_number = 0;
  sigwait(&ending, &signal_number);
  return EX_OK;
}

}  // namespace
}  // namespace lensd::sim

int main(int argc, char** argv) {
  return lensd::sim::Main(argc, argv);
}
