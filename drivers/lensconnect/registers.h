// The lens behind the bridge: 16-bit registers at SMBus address 0x20, big-endian, each access with a finite number of
// attempts.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "cp2112.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::lensconnect {

/// General registers (the maker's DevAddr.py).
namespace address {
inline constexpr std::uint16_t kModelName = 0x0010;  ///< 24 bytes of ASCII
inline constexpr std::uint16_t kCapabilities = 0x0040;
inline constexpr std::uint16_t kStatus1 = 0x0042;      ///< motors that are busy
inline constexpr std::uint16_t kStatus2 = 0x0044;      ///< motors that need initialisation
inline constexpr std::uint16_t kTemperature = 0x0046;  ///< kelvin
// Of each motor, from its base.
inline constexpr std::uint16_t kPosition = 0x00;  ///< reading: the step it is at; writing: starts a move
inline constexpr std::uint16_t kStop = 0x04;
inline constexpr std::uint16_t kBacklashCancel = 0x06;
inline constexpr std::uint16_t kInitialize = 0x08;
inline constexpr std::uint16_t kInitialPosition = 0x10;  ///< where homing ends
inline constexpr std::uint16_t kMechanicalMinimum = 0x12;
inline constexpr std::uint16_t kMechanicalMaximum = 0x14;
inline constexpr std::uint16_t kOpticalMinimum = 0x16;
inline constexpr std::uint16_t kOpticalMaximum = 0x18;
inline constexpr std::uint16_t kSpeed = 0x1A;  ///< pulses per second
inline constexpr std::uint16_t kSpeedMinimum = 0x1C;
inline constexpr std::uint16_t kSpeedMaximum = 0x1E;
}  // namespace address

/// Where a motor's registers begin, and its bit in kCapabilities, kStatus1 and kStatus2.
struct Motor {
  Axis axis;
  std::uint16_t base;
  std::uint16_t mask;
};
inline constexpr std::array kMotors = {Motor{Axis::Zoom, 0x1000, 0x0002}, Motor{Axis::Focus, 0x2000, 0x0004},
                                       Motor{Axis::Iris, 0x3000, 0x0008}, Motor{Axis::Filter, 0x4000, 0x0010}};

inline constexpr std::uint16_t kAnyMotor = 0x001E;

/// One thread. Errors as those of Cp2112, after the attempts are used up.
class Registers {
 public:
  Registers(std::unique_ptr<Transport> transport, const Clock& clock) : bridge_(std::move(transport), clock) {}

  /// Sets up the bridge.
  Result<void> Open() { return bridge_.Configure(); }
  /// A new call of the lens begins: it ends by `deadline`, and an interrupt from before it is forgotten.
  void BeginCall(Instant deadline);

  Result<std::uint16_t> Read(std::uint16_t where);
  /// Text up to its first zero, without what cannot be printed and without trailing spaces.
  Result<std::string> ReadText(std::uint16_t where, std::size_t length);
  /// Writes to a motor's position, stop, backlash, initialise or speed register; Internal for any other address (the
  /// firmware loader is one). Where an attempt ends without a word, `obeyed` is asked whether the lens acts already.
  Result<void> Write(std::uint16_t where, std::uint16_t value, const std::function<bool()>& obeyed = {});

  /// Attempts that failed, whether or not the next one worked.
  std::uint64_t errors() const { return errors_; }

  void Interrupt() { bridge_.transport().Interrupt(); }

 private:
  template <class Once>
  Result<void> Attempt(Once once, const std::function<bool()>& obeyed);
  Result<void> ReadOnce(std::uint16_t where, std::span<std::uint8_t> data);

  Cp2112 bridge_;
  std::uint64_t errors_ = 0;
  bool unsure_ = false;  ///< the last transfer did not end properly
};

}  // namespace lensd::drivers::lensconnect
