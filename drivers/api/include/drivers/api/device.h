// A device: a lens, a camera, or both behind one handle; and how drivers are registered.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "base/settings.h"
#include "drivers/api/camera.h"
#include "drivers/api/lens.h"

namespace lensd::drivers {

/// What a driver knows of the optics of the lens it opened: a nominal calibration. Lengths in metres.
struct NominalOptics {
  double focal_length_m = 0.0;
  double min_f_number = 0.0;        ///< widest opening
  double max_f_number = 0.0;
  double min_extension_m = 0.0;     ///< extension at the focus axis' minimum
  double max_extension_m = 0.0;     ///< extension at the focus axis' maximum
  /// Iris: native minimum is min_f_number, maximum is max_f_number, even in log(f-number) between.
};

/// An open device. Either part may be absent, not both. Destroying it closes the handle.
struct Device {
  std::unique_ptr<Lens> lens;
  std::unique_ptr<Camera> camera;
  std::optional<NominalOptics> optics;  ///< only from drivers that know (the simulated one)
};

/// Opens a device from the table of its [[lens]] or [lens.camera] section. Every key must be known.
using OpenFunction = Result<Device> (*)(const Settings& settings, const Clock& clock);

/// One row of the table of drivers (daemon/drivers_table.cpp).
struct Driver {
  std::string_view name;
  OpenFunction open;
};

}  // namespace lensd::drivers
