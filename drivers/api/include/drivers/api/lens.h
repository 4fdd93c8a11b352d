// A motorised lens, as far as everything above the drivers knows it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/counters.h"

namespace lensd::drivers {

enum class Axis { Focus, Iris, Zoom, Filter };
inline constexpr std::array kAxes = {Axis::Focus, Axis::Iris, Axis::Zoom, Axis::Filter};
/// "focus", "iris", "zoom", "filter".
std::string_view AxisName(Axis axis);
std::optional<Axis> AxisFromName(std::string_view name);

/// One value per axis.
template <class T>
class PerAxis {
 public:
  T& operator[](Axis axis) { return values_[static_cast<std::size_t>(axis)]; }
  const T& operator[](Axis axis) const { return values_[static_cast<std::size_t>(axis)]; }
  bool operator==(const PerAxis&) const = default;

 private:
  std::array<T, kAxes.size()> values_{};
};

enum class NativeUnit { Steps, Dioptres, FNumber, Millimetres, Position };
std::string_view NativeUnitName(NativeUnit unit);

/// What a position tells of the mechanism.
enum class Feedback {
  None,    ///< nothing: it is what was commanded last
  Echo,    ///< nothing: the device repeats its target
  Counts,  ///< how many steps it made, as far as none was lost
  Encoder  ///< where it is: measured on what moves
};
/// In the order of Feedback: names for people, and choices of a configuration.
inline constexpr std::array<std::string_view, 4> kFeedbackNames = {"none", "echo", "counts", "encoder"};
inline std::string_view FeedbackName(Feedback feedback) {
  return kFeedbackNames[static_cast<std::size_t>(feedback)];
}
/// Positions change with the motion, and not with the command.
inline bool Follows(Feedback feedback) {
  return feedback == Feedback::Counts || feedback == Feedback::Encoder;
}

/// Which way a focus axis counts: whether larger native positions focus nearer or farther.
enum class Direction { NearPositive, NearNegative };
/// In the order of Direction: choices of a configuration, and names for people.
inline constexpr std::array<std::string_view, 2> kDirectionNames = {"near-positive", "near-negative"};
inline std::string_view DirectionName(Direction direction) {
  return kDirectionNames[static_cast<std::size_t>(direction)];
}

/// A direction that a driver can vouch for, because a standard or the maker of the device fixes it.
struct KnownDirection {
  Direction direction = Direction::NearPositive;
  std::string_view by;  ///< who says so, for people: "the V4L2 standard". A literal.
};

/// What one axis can do. Fixed for the life of the device.
struct AxisCapabilities {
  NativeUnit unit = NativeUnit::Steps;
  Native minimum{0.0};      ///< lowest target the device takes
  Native maximum{0.0};      ///< highest target the device takes
  double resolution = 1.0;  ///< native units between neighbouring targets, > 0
  /// Targets that the device's own count takes, where these are more than those from minimum to maximum: the count of a
  /// device that has lost it may be set off from the travel, which stays the same.
  std::optional<std::pair<Native, Native>> counts = {};
  Feedback feedback = Feedback::Counts;
  bool can_home = false;      ///< StartHome() finds a reference
  bool needs_home = false;    ///< absolute moves are refused before homing
  bool can_stop = true;       ///< Stop() ends a motion midway
  double speed = 0.0;         ///< native units per second as the data sheet has it; 0: not known
  Duration settle{};          ///< from standing still to a steady picture, as far as the driver knows
  double backlash = -1.0;     ///< native units, as far as the driver knows; 0: none; below 0: not known
  double lost_travel = -1.0;  ///< part of all travel that may get lost unnoticed; below 0: what its feedback suggests
  std::optional<KnownDirection> direction{};  ///< of focus; nothing: neither a standard nor the device says

  bool follows() const { return Follows(feedback); }
  Native lowest_count() const { return counts ? counts->first : minimum; }
  Native highest_count() const { return counts ? counts->second : maximum; }
};

/// What a lens is and can do. Immutable once the device is open.
struct Capabilities {
  std::string driver;
  std::string model;
  std::string serial;  ///< empty where the device has none
  PerAxis<std::optional<AxisCapabilities>> axes;
};

/// One axis at one instant.
struct AxisState {
  Native position{0.0};  ///< where the device says it is; without feedback the last target
  bool moving = false;
  bool homed = true;     ///< the position refers to a known reference
  bool assumed = false;  ///< that it went is taken for granted: the position may merely repeat the target
  bool waiting = false;  ///< commanded, but held back until another axis is done: moving, with no progress to expect
  std::string fault;     ///< empty, or what the device complains of ("stalled", "over temperature")
};

/// All axes at one instant.
struct LensState {
  Instant sampled_at{};
  PerAxis<std::optional<AxisState>> axes;
  std::optional<Celsius> temperature;
};

/// A lens. Calls check their arguments and forward to the driver; each I/O call ends within the driver's I/O deadline
/// and none waits for motion: poll Read(). One thread calls everything but Interrupt() and
/// CutReadShort(). The destructor stops what
/// moves, as far as the device can, and closes.
class Lens {
 public:
  virtual ~Lens() = default;
  Lens(const Lens&) = delete;
  Lens& operator=(const Lens&) = delete;

  const Capabilities& capabilities() const { return capabilities_; }

  /// Starts the search for the axis' reference. Unsupported: no such axis, or it cannot home. Disconnected, Timeout,
  /// Protocol: from the device.
  Result<void> StartHome(Axis axis);
  /// Starts a motion to `target` in native units; a motion under way is retargeted. Unsupported: no such axis.
  /// InvalidArgument: not a finite number. OutOfRange: outside what its count takes. Otherwise as StartHome().
  Result<void> StartMove(Axis axis, Native target);
  /// Where everything is now. Disconnected, Timeout, Protocol.
  Result<LensState> Read();
  /// Ends the motion of one axis where it is. Unsupported: the device cannot stop midway.
  Result<void> Stop(Axis axis);
  /// Clears what the device complains of, where it wants to be told; moves nothing. Unsupported: it takes no such
  /// command.
  Result<void> ResetFault(Axis axis);
  /// Questions that were not answered, or against the rules, since it was opened.
  std::uint64_t bus_errors() const { return DoCountBusErrors(); }
  /// From any thread: makes an I/O call in progress return Cancelled soon. Harmless when none is.
  void Interrupt() { DoInterrupt(); }
  /// From any thread: a Read() in progress returns Cancelled soon, where it takes long enough to matter, because
  /// something more urgent waits for it. Harmless when none is.
  void CutReadShort() { DoCutReadShort(); }

 protected:
  explicit Lens(Capabilities capabilities) : capabilities_(std::move(capabilities)) {}

 private:
  virtual Result<void> DoStartHome(Axis axis) = 0;
  virtual Result<void> DoStartMove(Axis axis, Native target) = 0;
  virtual Result<LensState> DoRead() = 0;
  virtual Result<void> DoStop(Axis axis) = 0;
  virtual Result<void> DoResetFault(Axis axis);
  virtual void DoInterrupt() {}
  virtual void DoCutReadShort() {}
  /// By default the calls that ended so; drivers that ask again by themselves know of more.
  virtual std::uint64_t DoCountBusErrors() const { return failed_calls_; }

  template <class T>
  Result<T> Noted(Result<T> result) {
    if (!result && IsBusError(result.error().code)) ++failed_calls_;
    return result;
  }
  Result<const AxisCapabilities*> Find(Axis axis) const;

  Capabilities capabilities_;
  std::uint64_t failed_calls_ = 0;
};

}  // namespace lensd::drivers
