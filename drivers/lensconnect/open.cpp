// Asking a lens what it has. Every answer must come twice in a row: right after enumeration a bridge may send reports
// that answer no question (erratum E111), and a limit misread here would stay wrong for the life of the device.
#include <utility>

#include "lensconnect_lens.h"

namespace lensd::drivers::lensconnect {
namespace {

constexpr int kOpenTimeouts = 10;  ///< of the I/O time-out, for what is asked of the whole lens
constexpr int kMotorTimeouts = 4;  ///< the same of one motor, which takes some thirty transfers
constexpr int kSameTwice = 6;
constexpr std::size_t kNameLength = 24;

Result<std::uint16_t> ReadTwice(Registers& registers, std::uint16_t where) {
  auto before = registers.Read(where);
  for (int i = 0; before && i < kSameTwice; ++i) {
    auto value = registers.Read(where);
    if (!value || *value == *before) return value;
    before = value;
  }
  if (!before) return before;
  return Fail(Code::Protocol, "the lens gives a different answer each time");
}

/// Reads a register into `into`; further calls do nothing once one has failed.
class Asking {
 public:
  explicit Asking(Registers& registers) : registers_(registers) {}
  void operator()(std::uint16_t where, std::uint16_t& into) {
    if (!ended_) return;
    auto value = ReadTwice(registers_, where);
    if (value) {
      into = *value;
    } else {
      ended_ = PassOn(value);
    }
  }
  const Result<void>& ended() const { return ended_; }

 private:
  Registers& registers_;
  Result<void> ended_;
};

}  // namespace

Result<LensConnectLens::Track> LensConnectLens::AskMotor(Registers& registers, const Motor& motor,
                                                         const Config& config) {
  Track track;
  track.motor = motor;
  track.reversed =
      (motor.axis == Axis::Iris && config.iris_reversed) || (motor.axis == Axis::Zoom && config.zoom_reversed);
  Asking ask(registers);
  // The ranges the maker's software uses: optical for zoom, mechanical for the others, the filter from 0.
  const bool zoom = motor.axis == Axis::Zoom;
  if (motor.axis != Axis::Filter) {
    ask(motor.base + (zoom ? address::kOpticalMinimum : address::kMechanicalMinimum), track.minimum);
  }
  ask(motor.base + (zoom ? address::kOpticalMaximum : address::kMechanicalMaximum), track.maximum);
  ask(motor.base + address::kInitialPosition, track.home_position);
  if (!ask.ended()) return PassOn(ask.ended().error());
  const auto position = registers.Read(motor.base + address::kPosition);  // once: it may be moving
  if (!position) return PassOn(position);
  track.position = *position;
  if (track.minimum >= track.maximum) {
    return Fail(Code::Protocol, "the lens says that its " + std::string(AxisName(motor.axis)) + " goes from " +
                                    std::to_string(track.minimum) + " to " + std::to_string(track.maximum));
  }
  return track;
}

/// Computar's own sample programs: the key "Near" adds steps to focus, "Far" takes them away.
constexpr KnownDirection kByComputar{Direction::NearPositive, "the maker of the lens (LensConnect)"};

Result<AxisCapabilities> LensConnectLens::AskSpeed(Registers& registers, const Track& track, const Config& config) {
  const Motor& motor = track.motor;
  AxisCapabilities can{.unit = NativeUnit::Steps,
                       .minimum = Native{double(track.minimum)},
                       .maximum = Native{double(track.maximum)},
                       .can_home = true,
                       .needs_home = true,
                       .can_stop = motor.axis != Axis::Filter && config.stop_value != 0};
  if (motor.axis == Axis::Focus) can.direction = kByComputar;
  if (motor.axis == Axis::Filter) return can;  // it has no speed
  const std::string name(AxisName(motor.axis));
  if (config.backlash_cancel) {
    auto set = registers.Write(motor.base + address::kBacklashCancel, *config.backlash_cancel ? 1 : 0);
    if (!set) return PassOn(set);
  }
  std::uint16_t slowest = 0, fastest = 0, speed = 0;
  Asking ask(registers);
  if (const auto wanted = config.speed[motor.axis]) {
    ask(motor.base + address::kSpeedMinimum, slowest);
    ask(motor.base + address::kSpeedMaximum, fastest);
    if (ask.ended() && (*wanted < slowest || *wanted > fastest)) {
      return Fail(Code::OutOfRange, name + "_pps = " + std::to_string(*wanted) + " is outside what the lens allows (" +
                                        std::to_string(slowest) + " to " + std::to_string(fastest) + ")");
    }
    if (ask.ended()) {
      auto set = registers.Write(motor.base + address::kSpeed, *wanted);
      if (!set) return PassOn(set);
    }
  }
  ask(motor.base + address::kSpeed, speed);
  if (!ask.ended()) return PassOn(ask.ended().error());
  if (config.speed[motor.axis] && speed != *config.speed[motor.axis]) {
    return Fail(Code::Protocol, "the lens did not take " + name + "_pps and keeps " + std::to_string(speed));
  }
  can.speed = speed;
  return can;
}

Result<LensConnectLens::Found> LensConnectLens::AskAxis(Registers& registers, const Motor& motor, const Config& config,
                                                        bool lost) {
  auto track = AskMotor(registers, motor, config);
  if (!track) return PassOn(track);
  track->homed = !lost;
  auto can = AskSpeed(registers, *track, config);
  if (!can) return PassOn(can);
  return Found{*std::move(track), *can};
}

Result<std::unique_ptr<Lens>> LensConnectLens::Open(std::unique_ptr<Transport> transport, const Config& config,
                                                    std::string serial, Findings& findings, const Clock& clock) {
  auto registers = std::make_unique<Registers>(std::move(transport), clock);
  registers->BeginCall(clock.Now() + kOpenTimeouts * config.io_timeout);
  if (auto opened = registers->Open(); !opened) return PassOn(opened);
  std::uint16_t present = 0, lost = 0;
  Asking ask(*registers);
  ask(address::kCapabilities, present);
  ask(address::kStatus2, lost);
  if (!ask.ended()) return PassOn(ask.ended().error());
  Capabilities can{.driver = "lensconnect", .model = {}, .serial = std::move(serial), .axes = {}};
  PerAxis<std::optional<Track>> tracks;
  bool any = false;
  for (const Motor& motor : kMotors) {
    if ((present & motor.mask) == 0) continue;
    registers->BeginCall(clock.Now() + kMotorTimeouts * config.io_timeout);
    auto found = AskAxis(*registers, motor, config, (lost & motor.mask) != 0);
    if (!found && (ConcernsAll(found.error()) || config.names(motor.axis))) return PassOn(found);
    if (!found) findings.LeaveOut(AxisName(motor.axis), found.error());
    if (!found) continue;
    any = true;
    can.axes[motor.axis] = found->can;
    tracks[motor.axis] = std::move(found->track);
  }
  if ((present & kAnyMotor) == 0) return Fail(Code::WrongDevice, "the lens says that it has no motors");
  if (!any) return PassOn(findings.NothingLeft("the lens"));
  registers->BeginCall(clock.Now() + kMotorTimeouts * config.io_timeout);
  auto model = registers->ReadText(address::kModelName, kNameLength);
  if (!model) return PassOn(model);
  can.model = model->empty() ? "LensConnect" : *model;
  return std::unique_ptr<Lens>(
      new LensConnectLens(std::move(can), std::move(registers), std::move(tracks), config, clock));
}

}  // namespace lensd::drivers::lensconnect
