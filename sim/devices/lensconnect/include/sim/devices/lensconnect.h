// A simulated Computar LensConnect lens at the level of its HID reports: CP2112 bridge, SMBus slave, motors, and faults
// on demand. Knows nothing of the driver.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "sim/devices/lensconnect_motor.h"

namespace lensd::sim::devices {

enum class LensConnectAxis : std::size_t { Zoom, Focus, Iris, Filter };

struct LensConnectTraits {
  std::string model = "Simulated LensConnect";
  std::array<LensConnectMotorTraits, 4> motors{
      LensConnectMotorTraits{}, LensConnectMotorTraits{},
      LensConnectMotorTraits{.mechanical_maximum = 600, .home_position = 0, .speed = 1000},
      LensConnectMotorTraits{.mechanical_maximum = 3, .home_position = 0, .speed = 10, .can_stop = false}};
  std::uint16_t kelvin = 298;
  int busy_polls = 1;                                ///< so often a transfer answers "busy" before it is complete
  Duration late_by = std::chrono::milliseconds(60);  ///< of a late reply
};

/// What the next so many occasions do; each fault has its own count.
enum class LensConnectFault {
  Nack,        ///< the lens does not acknowledge; nothing is carried out
  LostReply,   ///< an input report never comes
  LateReply,   ///< an input report comes late_by later
  StrayReply,  ///< another input report comes first, one the driver would like to believe
  ShortReply,  ///< a read response holds one byte less
  Ignored,     ///< a move or homing is acknowledged and not carried out
  Hang,        ///< a transfer stays busy until it is cancelled
};
inline constexpr std::array kLensConnectFaults = {LensConnectFault::Nack,       LensConnectFault::LostReply,
                                                  LensConnectFault::LateReply,  LensConnectFault::StrayReply,
                                                  LensConnectFault::ShortReply, LensConnectFault::Ignored,
                                                  LensConnectFault::Hang};

/// One thread.
class LensConnect {
 public:
  using Report = std::vector<std::uint8_t>;

  /// `clock` must outlive it. Powered on just now: every motor needs homing.
  LensConnect(LensConnectTraits traits, const Clock& clock);

  /// Host to device. Reports that make no sense are ignored, as the chip does.
  void Output(std::span<const std::uint8_t> report);
  void SetFeature(std::span<const std::uint8_t> report);
  /// Empty: there is no such report.
  Report GetFeature(std::uint8_t id);
  /// Device to host: the next report that is due, and when there will be one.
  std::optional<Report> TakeInput();
  std::optional<Instant> NextInput() const;
  /// Puts a report into the queue, as chips do after enumeration (erratum E111).
  void SendUnasked(Report report) { Queue(std::move(report), clock_.Now()); }

  void Spoil(LensConnectFault fault, int count = 1) { spoiled_[fault] = count; }
  void EndFaults() { spoiled_.clear(); }
  LensConnectMotor& motor(LensConnectAxis axis) { return motors_[static_cast<std::size_t>(axis)]; }
  void LosePower();

  int forbidden() const {
    return counts_.forbidden;
  }  ///< writes to one-time-programmable memory or to the firmware loader
  int resets() const { return counts_.resets; }
  int starts() const { return counts_.starts; }      ///< moves and homings asked for
  int overlaps() const { return counts_.overlaps; }  ///< of those, asked for while another motor ran

 private:
  enum class Phase : std::uint8_t { Idle, Busy, Complete, Failed };
  /// The newest on the SMBus.
  struct Transfer {
    Phase phase = Phase::Idle, end = Phase::Idle;
    std::uint8_t detail = 0;
    std::uint16_t count = 0;
    int polls_left = 0;
    bool hangs = false;
  };
  struct Counts {
    int strays = 0, forbidden = 0, resets = 0, starts = 0, overlaps = 0;
  };

  void StartTransfer(Phase end, std::uint8_t detail, std::uint16_t bytes);
  void SmbusWrite(std::span<const std::uint8_t> data);
  void WriteRegister(std::uint16_t where, std::uint16_t value);
  void Start(std::size_t index, bool home, std::uint16_t value);
  std::uint16_t Register(std::uint16_t where) const;
  std::uint16_t MotorRegister(const LensConnectMotor& motor, std::uint16_t offset) const;
  std::uint8_t Byte(std::uint16_t where) const;
  void SendStatus();
  void SendData(std::size_t length);
  void Send(Report report);
  void Queue(Report report, Instant due);
  Report Stray();
  bool Spoils(LensConnectFault fault);
  void ResetChip();

  LensConnectTraits traits_;
  const Clock& clock_;
  std::vector<LensConnectMotor> motors_;
  Report configuration_;
  Transfer transfer_;
  std::uint16_t pointer_ = 0;
  Report read_buffer_;
  std::multimap<Instant, Report> input_;
  std::map<LensConnectFault, int> spoiled_;
  std::uint16_t last_target_ = 0;
  Counts counts_;
};

}  // namespace lensd::sim::devices
