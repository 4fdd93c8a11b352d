// Simulated drives on a wire, and lenses opened on them.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "drivers/modbus/driver.h"
#include "io/toml.h"
#include "sim/devices/modbus_bus.h"

namespace lensd::drivers::modbus {

/// A busy machine may keep the simulator from answering for longer than a real drive would.
inline constexpr auto kPatient = "response_timeout_ms = 300";

/// A folder that goes with its owner.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "lensd-modbus-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// What the daemon does with settings: every `profile = "NAME"` becomes the profile's table.
inline Settings WithShippedProfiles(const Settings& settings) {
  const Settings::Table* table = settings.AsTable();
  if (table == nullptr) return settings;
  Settings::Table done;
  for (const auto& [key, value] : *table) {
    const auto* name = std::get_if<std::string>(&value.value());
    if (key == "profile" && name != nullptr) {
      done.emplace(key, *io::ParseToml(ShippedProfile(*name), "profile " + *name));
    } else {
      done.emplace(key, WithShippedProfiles(value));
    }
  }
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(done)), settings.where());
}

/// A wire with drives on it: unit 1 on, in the order given.
class Bench {
 public:
  explicit Bench(bool serial, const std::vector<std::string>& profiles) : serial_(serial) {
    int unit = 0;
    for (const std::string& profile : profiles) wire.AddDrive(++unit, sim::MakeModbusDrive(profile));
    Plug();
  }

  void Plug() {
    if (serial_) {
      const auto served = wire.ServeRtu(folder_ / "port");
      EXPECT_TRUE(served.has_value()) << served.error().message;
    } else {
      const auto served = wire.ServeTcp(port_);
      ASSERT_TRUE(served.has_value()) << served.error().message;
      port_ = *served;
    }
  }
  std::string port() const { return folder_ / "port"; }

  /// `drives`: the TOML of [drives.AXIS] tables. `bus`: further keys of the bus.
  Result<Device> Open(const std::string& drives, const std::string& bus = kPatient) {
    const std::string where =
        serial_ ? "device = \"" + port() + "\"" : "host = \"127.0.0.1:" + std::to_string(port_) + "\"";
    const auto settings = io::ParseToml("[bus]\nname = \"bench\"\n" + where + "\n" + bus + "\n" + drives, "bench.toml");
    if (!settings) return PassOn(settings);
    // A busy machine misses a short timeout.
    for (int tries = 1;; ++tries) {
      auto device = OpenModbus(WithShippedProfiles(*settings), clock);
      const bool silent = !device && device.error().message.find("does not answer") != std::string::npos;
      if (!silent || tries == 5) return device;
    }
  }

  /// Reads until `done` says so of an axis, for at most so long.
  template <class Done>
  bool Until(Lens& lens, Axis axis, Done&& done, Duration at_most = std::chrono::seconds(20)) {
    const Instant end = clock.Now() + at_most;
    Result<LensState> state;
    while (clock.Now() < end) {
      state = lens.Read();
      if (state && done(*state->axes[axis])) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!state) {
      std::cerr << "the last read: " << state.error().message << '\n';
    } else {
      const AxisState& last = *state->axes[axis];
      std::cerr << "the last read: at " << last.position.value << (last.moving ? ", moving" : ", at rest")
                << (last.homed ? ", homed, \"" : ", not homed, \"") << last.fault << "\"\n";
    }
    return false;
  }
  bool Rests(Lens& lens, Axis axis) {
    return Until(lens, axis, [](const AxisState& state) { return !state.moving; });
  }
  bool Home(Lens& lens, Axis axis) {
    const auto started = lens.StartHome(axis);
    EXPECT_TRUE(started.has_value()) << started.error().message;
    return started && Until(lens, axis, [](const AxisState& state) { return !state.moving && state.homed; });
  }
  double Count(int unit) {
    return wire.With(unit, [](sim::ModbusDrive& drive, Duration now) { return drive.shaft().CountAt(now); });
  }
  int Motions(int unit) {
    return wire.With(unit, [](sim::ModbusDrive& drive, Duration) { return drive.motions(); });
  }
  void Alarm(int unit, std::uint32_t alarm) {
    wire.With(unit, [&](sim::ModbusDrive& drive, Duration now) { drive.RaiseAlarm(alarm, now); });
  }

  const MonotonicClock clock;
  sim::ModbusBus wire;

 private:
  const bool serial_;
  Folder folder_;
  int port_ = 0;
};

/// A drive's table, fast enough for tests.
inline std::string FastAz(const std::string& axis, int unit, const std::string& range = "[0, 2000]") {
  return "[drives." + axis + "]\nunit = " + std::to_string(unit) + "\nprofile = \"oriental-az\"\nrange = " + range +
         "\nparameters = { speed = 50000, start_rate = 5000000, stop_rate = 5000000 }\n";
}

}  // namespace lensd::drivers::modbus
