// The camera's own automatic focus, iris and exposure: switched off before anything is set by hand, and given back.
#pragma once

#include <cstdint>
#include <optional>

#include "controls.h"
#include "descriptors.h"

namespace lensd::drivers::uvc {

/// One thread.
class Automatics {
 public:
  Automatics(Controls& controls, const CameraTerminal& terminal, std::uint8_t interface)
      : controls_(controls), terminal_(terminal), interface_(interface) {}

  /// Focus is ours from now on. Harmless where there is no automatic focus. Errors as Controls::Set().
  Result<void> TakeFocus();
  /// The iris is ours; exposure stays automatic where the camera can do one without the other.
  Result<void> TakeIris();
  /// The exposure time is ours; the iris too if it was before.
  Result<void> TakeExposure();
  /// Back to what was found, as far as the camera answers.
  void Restore();

 private:
  ControlAddress At(const UnitControl& control) const { return {control.selector, terminal_.id, interface_}; }
  /// Sets the AE mode to the first of `modes` that the camera has, unless it is in one of `good` already.
  Result<void> TakeMode(std::uint8_t good, std::initializer_list<std::uint8_t> modes, const char* what);
  Result<void> SetMode(std::uint8_t mode);

  Controls& controls_;
  const CameraTerminal terminal_;
  const std::uint8_t interface_;
  bool iris_taken_ = false;
  std::optional<std::uint8_t> focus_before_;  ///< set while ours differs
  std::optional<std::uint8_t> mode_before_;
};

}  // namespace lensd::drivers::uvc
