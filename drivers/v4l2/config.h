// What the configuration says of a v4l2 device.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/settings.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::v4l2 {

/// How a control's numbers are to be read. Drivers agree on neither unit nor direction, so nothing is assumed.
struct AxisConfig {
  drivers::NativeUnit unit = drivers::NativeUnit::Steps;
  double scale = 1.0;  ///< native units a count of the control
  std::optional<double>
      speed{};  ///< native units per second; long moves are cut into pieces at this speed. 0: one write
  std::optional<Duration> settle{};
};

enum class Parts { Both, Lens, Camera };
/// Which values of 8-bit video are black and white: as the driver says, 0..255, or 16..235.
enum class VideoRange { Auto, Full, Limited };

struct Config {
  // Which device: one of these groups, or none for the only video device there is.
  std::string device{};   ///< a node
  std::string serial{};   ///< of the USB device
  std::string id_path{};  ///< udev's ID_PATH
  std::string sensor{};   ///< the lens that belongs to this sensor, by its name in the media graph or a part of it
  std::string i2c_bus{};  ///< "/dev/i2c-10"
  std::uint16_t i2c_address = 0x0c;
  std::string chip{};  ///< at i2c_address: "dw9714"

  Parts parts = Parts::Both;
  drivers::PerAxis<AxisConfig> axes{};

  std::string format{};  ///< four letters; empty: as the device is set
  int width = 0;         ///< px; 0: as the device is set
  int height = 0;
  double frame_rate_hz = 0.0;  ///< 0: as the device is set
  double pixel_um = 0.0;
  std::optional<double> gamma{};
  VideoRange range = VideoRange::Auto;
  std::optional<Duration> latency{};  ///< from the end of an exposure to its time stamp, at most
  int buffers = 4;

  /// It says which pictures are wanted: a camera without them is not the one that is configured.
  bool names_pictures() const { return !format.empty() || width > 0 || frame_rate_hz > 0.0; }
};

/// BadData.
Result<Config> ReadConfig(const Settings& settings);

}  // namespace lensd::drivers::v4l2
