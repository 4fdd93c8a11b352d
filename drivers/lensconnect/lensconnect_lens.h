// The lens: what its motors were told, what they did, and when that counts as done.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"
#include "registers.h"

namespace lensd::drivers::lensconnect {

/// The driver's keys of a [[lens]] section, but for which lens it is.
struct Config {
  Duration io_timeout = std::chrono::milliseconds(500);     ///< within which every call ends
  Duration start_timeout = std::chrono::milliseconds(500);  ///< within which a commanded motor shows that it is busy
  bool concurrent_axes = false;         ///< several motors may run at once; the maker's software never lets them
  std::uint16_t stop_value = 1;         ///< what STOP wants written is not documented; 0: this lens cannot stop
  bool iris_reversed = false;           ///< larger steps open the iris
  bool zoom_reversed = false;           ///< counts zoom from its other end
  std::optional<bool> backlash_cancel;  ///< the lens' own backlash compensation; none: as it is
  PerAxis<std::optional<std::uint16_t>> speed;  ///< pulses per second; none: as it is

  /// Whether a key says something of this axis.
  bool names(Axis axis) const {
    return speed[axis] || (axis == Axis::Iris && iris_reversed) || (axis == Axis::Zoom && zoom_reversed);
  }
};

/// See drivers/api/lens.h. Busy may rise late, or not at all where a motor is there already or was quick; an end of a
/// motion counts only when two looks agree on it, because any reply may be another program's.
class LensConnectLens final : public Lens {
 public:
  /// Sets up the bridge and asks the lens what it has. A motor that is listed and cannot be used is left out, unless
  /// `config` names it. Disconnected, Timeout, Protocol; OutOfRange: a speed that the motor does not have.
  static Result<std::unique_ptr<Lens>> Open(std::unique_ptr<Transport> transport, const Config& config,
                                            std::string serial, Findings& findings, const Clock& clock);
  ~LensConnectLens() override;

 private:
  struct Command {
    bool home = false;
    std::uint16_t target = 0;  ///< the lens' own steps
  };
  /// One motor.
  struct Track {
    Motor motor;
    std::uint16_t minimum = 0, maximum = 0;  ///< the lens' own steps
    std::uint16_t home_position = 0;         ///< where homing ends
    bool reversed = false;
    std::uint16_t position = 0;
    bool homed = false;
    std::string fault;
    std::optional<Command> running;  ///< told to the lens, not yet seen to end
    std::optional<Command> queued;   ///< to follow
    bool seen_busy = false;
    bool stopping = false;
    bool astray = false;  ///< was busy when last looked at, without a command of ours
    int issued = 0;
    Instant issued_at{};

    Native ToNative(std::uint16_t step) const;
    std::uint16_t FromNative(Native native) const;
  };

  LensConnectLens(Capabilities capabilities, std::unique_ptr<Registers> registers, PerAxis<std::optional<Track>> tracks,
                  const Config& config, const Clock& clock);
  struct Found {
    Track track;
    AxisCapabilities can;
  };
  static Result<Found> AskAxis(Registers& registers, const Motor& motor, const Config& config, bool lost);
  static Result<Track> AskMotor(Registers& registers, const Motor& motor, const Config& config);
  static Result<AxisCapabilities> AskSpeed(Registers& registers, const Track& track, const Config& config);

  Result<void> DoStartHome(Axis axis) override;
  Result<void> DoStartMove(Axis axis, Native target) override;
  Result<LensState> DoRead() override;
  void Halt();
  Result<void> DoStop(Axis axis) override;
  void DoInterrupt() override { registers_->Interrupt(); }
  std::uint64_t DoCountBusErrors() const override { return registers_->errors(); }

  void BeginCall();
  Result<void> Take(Track& track, Command command);
  Result<void> Issue(Track& track, Command command);
  Result<void> WriteStop(Track& track);
  Result<void> LookWhoIsBusy();
  Result<void> Follow(Track& track);
  Result<void> FollowBusy(Track& track, bool late);
  Result<void> Conclude(Track& track);
  Result<void> StartQueued();
  Result<void> LookAtRest();
  Result<std::uint16_t> ReadSettled(std::uint16_t where, std::uint16_t expected);
  bool MayStart(const Track& track) const;
  LensState State(Instant sampled_at) const;

  std::unique_ptr<Registers> registers_;
  PerAxis<std::optional<Track>> tracks_;
  Config config_;
  const Clock& clock_;
  std::uint16_t busy_ = 0;  ///< as of the last look
  std::optional<Celsius> temperature_;
  std::optional<Instant> felt_at_;  ///< when the temperature was read
};

}  // namespace lensd::drivers::lensconnect
