// The keys of the driver "aravis".
#pragma once

#include <array>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/settings.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::aravis {

/// What the timestamp of a frame means.
enum class StampMeaning { ExposureStart, ExposureEnd, Nothing };

struct CameraConfig {
  double pixel_um = 0.0;                     ///< 0: what the camera says
  std::string pixel_format;                  ///< empty: the current one where it can be read, else the first that can
  std::optional<double> exposure_ms;         ///< none: as it is
  std::optional<double> gain;                ///< none: as it is
  std::optional<double> frame_rate_hz;       ///< none: as it is
  std::string trigger;                       ///< a trigger source; empty: free running
  std::optional<std::array<int, 4>> region;  ///< x, y, width, height; none: as it is
  int packet_size = 1400;                    ///< GigE Vision: bytes of a packet, IP header included
  std::optional<double> packet_delay_us;     ///< GigE Vision: between packets
  bool resend = true;                        ///< GigE Vision: ask for lost packets again
  int buffers = 8;
  double gamma = 1.0;  ///< of the samples
  StampMeaning stamp = StampMeaning::ExposureStart;

  /// It says how pictures are to be: a camera without them is not the one that is configured.
  bool names_pictures() const {
    return !pixel_format.empty() || !trigger.empty() || exposure_ms || gain || frame_rate_hz || region;
  }
};

struct LensNames {
  PerAxis<std::string> feature;  ///< overrides of the candidates; "none": no such axis; empty: look for one
  std::string status;            ///< overrides of the controller's; "none", or empty
  std::string initialize;
  std::string abort;
  std::string controller;            ///< entry of the selector; empty: as it is
  std::optional<Feedback> feedback;  ///< none: what the table of names says
};

struct DriverConfig {
  std::string serial;
  std::string address;
  std::string id;
  Duration deadline = std::chrono::milliseconds(1000);  ///< of one call
  CameraConfig camera;
  LensNames lens;

  /// "serial \"X\"": for messages.
  std::string Named() const;
};

/// BadData: "file:line: what is wrong".
Result<DriverConfig> ReadDriverConfig(const Settings& settings);

}  // namespace lensd::drivers::aravis
