// The driver's keys as a typed struct.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/settings.h"
#include "controls.h"
#include "descriptors.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::uvc {

struct LensConfig {
  Feedback feedback = Feedback::Echo;    ///< what reading back tells
  bool completion_events = true;         ///< asynchronous controls are believed to say when they are done
  bool iris_is_f_number = true;          ///< iris values are hundredths of an f-number
  std::optional<Duration> focus_travel;  ///< focus by relative moves alone: time from end to end at focus_speed
  std::uint8_t focus_speed = 1;          ///< of relative moves
};

struct CameraConfig {
  std::optional<PixelFormat> format;
  std::optional<int> width;   ///< px
  std::optional<int> height;  ///< px
  std::optional<double> frame_rate_hz;
  std::optional<double> gamma;
  std::optional<Duration> latency;  ///< from the end of an exposure to its first byte, at most
  Duration frame_timeout = std::chrono::seconds(5);
  double pixel_um = 0.0;
};

struct UvcConfig {
  std::string serial;   ///< empty: any
  std::string id_path;  ///< empty: any
  std::string product;  ///< "046d:0825"; empty: any
  std::optional<int> terminal;
  bool lens = true;
  bool camera = true;
  ControlOptions controls;
  LensConfig lens_config;
  CameraConfig camera_config;
};

/// BadData: "file:line: what is wrong".
Result<UvcConfig> ReadConfig(const Settings& settings);

}  // namespace lensd::drivers::uvc
