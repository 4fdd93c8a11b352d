// A lens of one Modbus drive without its bus: on the test's own wire, and on a stepped clock.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "drive.h"
#include "drivers/modbus/driver.h"
#include "io/toml.h"
#include "profile.h"

namespace lensd::testing {

/// A drive of the profile "generic", from 0 to `range`.
inline drivers::modbus::DriveConfig GenericDrive(double range) {
  static const Settings file =
      io::ParseToml(std::string(drivers::modbus::ShippedProfile("generic")), "generic.toml").value();
  drivers::modbus::DriveConfig config;
  config.profile = drivers::modbus::ReadProfile(file).value();
  config.high = range;
  return config;
}

template <class Wire>
class DriveLens final : public drivers::Lens {
 public:
  DriveLens(const drivers::modbus::DriveConfig& config, std::unique_ptr<Wire> wire, const Clock& clock)
      : Lens(Can(config)), wire_(std::move(wire)), drive_(config, "the drive", clock) {}

 private:
  static drivers::Capabilities Can(const drivers::modbus::DriveConfig& config) {
    drivers::Capabilities can{.driver = "modbus", .model = "generic", .serial = "1", .axes = {}};
    can.axes[drivers::Axis::Focus] =
        drivers::AxisCapabilities{.minimum = Native{config.low}, .maximum = Native{config.high}, .can_home = true};
    return can;
  }
  Result<void> DoStartHome(drivers::Axis) override { return Fail(Code::Unsupported, "not here"); }
  Result<void> DoStartMove(drivers::Axis, Native target) override {
    return drive_.Execute({.kind = drivers::modbus::Order::Kind::Move, .target = std::llround(target.value)}, *wire_);
  }
  Result<drivers::LensState> DoRead() override {
    auto sample = drive_.Look(*wire_);
    if (!sample) return PassOn(sample);
    drivers::LensState state{.sampled_at = sample->at, .axes = {}, .temperature = {}};
    state.axes[drivers::Axis::Focus] = sample->state;
    return state;
  }
  Result<void> DoStop(drivers::Axis) override { return drive_.Halt(*wire_); }

  const std::unique_ptr<Wire> wire_;
  drivers::modbus::Drive drive_;
};

}  // namespace lensd::testing
