// A search for focus under conditions of its own, such as wide open and with a short exposure, and what became of them.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "base/units.h"
#include "drivers/api/camera.h"
#include "rig/focus_shift.h"

namespace lensd::rig {

/// What is set for a search, and brought back when that has ended, however it did.
struct SearchConditions {
  drivers::ExposureState exposure{};  ///< exposure time and gain, where they are given
  std::optional<FNumber> f_number{};
  std::optional<Native> filter{};
  /// Whether focus goes on, from where the search found it to where it is without them.
  enum class Shift { Apply, Ignore };
  Shift shift = Shift::Apply;
};

/// What became of them.
struct SearchedUnder {
  drivers::ExposureState exposure{};  ///< of the search, as the camera said
  FocusConditions search{};           ///< where iris and filter stood for it
  FocusConditions work{};             ///< where they stand otherwise
  std::string stays{};                ///< empty: all is as before; or what is not, and why
  std::optional<ShiftSize> shift{};   ///< that was applied; nothing: it was not
  std::string shift_reason{};         ///< empty, or why not
};

}  // namespace lensd::rig
