// The GenICam description of the simulated camera.
#pragma once

#include <optional>
#include <string>

namespace lensd::sim {

/// Where the lens' registers are. A position is written to `target` and read from `place`: what a client writes
/// is one more, and toggles the top bit, so that the same target twice can be told from once. The command registers
/// carry the top bits of the targets as they were when the command was given, so that what came first is known.
namespace registers {
inline constexpr unsigned kFocusTarget = 0x8000;
inline constexpr unsigned kFocusPlace = 0x8004;
inline constexpr unsigned kIrisTarget = 0x8010;
inline constexpr unsigned kIrisPlace = 0x8014;
inline constexpr unsigned kZoomTarget = 0x8020;
inline constexpr unsigned kZoomPlace = 0x8024;
inline constexpr unsigned kStatus = 0x8040;
inline constexpr unsigned kInitialize = 0x8044;
inline constexpr unsigned kAbort = 0x8048;
inline constexpr unsigned kDisconnect = 0x804c;
inline constexpr unsigned kTemperature = 0x8050;
inline constexpr unsigned kSelector = 0x8054;
inline constexpr unsigned kPixelPitch = 0x8058;
inline constexpr unsigned kToggle = 0x80000000;
inline constexpr unsigned kTimestampControl = 0x0944;
inline constexpr unsigned kTimestampHigh = 0x0948;
}  // namespace registers

/// One axis, in whole units of `unit` of its feature.
struct LensAxisText {
  double minimum = 0.0;
  double maximum = 0.0;
  double per_count = 1.0;  ///< feature units a count of the register; 1: an integer feature
  double zero = 0.0;       ///< feature value at count 0
  double step = 0.0;       ///< increment stated for a feature of real numbers; 0: none
};

struct GenicamOptions {
  std::string names = "sfnc";
  int width = 0;
  int height = 0;
  LensAxisText focus;
  bool focus_is_power = false;  ///< FocalPower instead of FocusStepper
  std::optional<LensAxisText> iris;
  std::optional<LensAxisText> zoom;
};

/// Empty for names it does not know.
std::string GenicamText(const GenicamOptions& options);

}  // namespace lensd::sim
