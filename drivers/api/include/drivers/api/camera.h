// A camera, as far as everything above the drivers knows it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/counters.h"

namespace lensd::drivers {

/// Makes the colours of one frame when a client wants to see them: red, green, blue of each pixel, 3 * width * height
/// samples. Null where its bytes turn out to hold no picture. From any thread.
using ColourMaker = std::function<std::shared_ptr<const std::vector<std::uint16_t>>()>;

/// One picture, row-major, without padding: luminance, which is what everything measures, and colour where the camera
/// has it. Cheap to copy: the samples are shared and never change.
struct Frame {
  int width = 0;                                              ///< px
  int height = 0;                                             ///< px
  int bits = 8;                                               ///< significant bits a sample; full scale is 2^bits - 1
  double gamma = 1.0;                                         ///< sample = light^(1/gamma); 1: linear light
  std::shared_ptr<const std::vector<std::uint16_t>> samples;  ///< width * height
  ColourMaker colour;                                         ///< of the same bits and gamma; null: there is none
  std::uint64_t sequence = 0;                                 ///< counts frames exposed, lost ones included
  Instant exposure_start{};                                   ///< CLOCK_MONOTONIC
  Instant exposure_end{};
};

/// A rectangle of the frame, as fractions of its width and height from the top left corner.
struct Region {
  double x = 0.4;
  double y = 0.4;
  double width = 0.2;
  double height = 0.2;
};

/// What a gain is counted in. Native: as the camera counts it.
enum class GainUnit { Decibels, Native };

/// Gains that a camera takes.
struct GainRange {
  double lowest = 0.0;
  double highest = 0.0;
  GainUnit unit = GainUnit::Native;
  double step = 0.0;  ///< from one to the next, counted from the lowest; 0: none, or not known
};

/// How a camera is to expose, or does; nothing: left as it is, or not known.
struct ExposureState {
  std::optional<Duration> exposure{};
  std::optional<double> gain{};  ///< in the unit of its GainRange
};

/// What a camera is. Immutable once the device is open.
struct CameraCapabilities {
  std::string driver;
  std::string model;
  std::string serial;
  int width = 0;   ///< px
  int height = 0;  ///< px
  int bits = 8;
  bool colour = false;     ///< its frames carry colour
  bool on_demand = false;  ///< frames are made when they are asked for: each may keep the next one back
  double pixel_um = 0.0;   ///< pitch; 0: unknown
  double frame_rate_hz = 0.0;
  bool can_set_exposure = false;
  Duration shortest_exposure{};     ///< that SetExposure() takes; 0: not known
  Duration longest_exposure{};      ///< 0: not known
  Duration exposure_step{};         ///< from one to the next, counted from the shortest; 0: none, or not known
  std::optional<GainRange> gain{};  ///< nothing: it cannot be set
  Region focus_region;  ///< where autofocus looks unless told otherwise; the centre where the camera has no opinion
};

/// Frames that came, one after the other, and could not be used.
struct UnusableFrames {
  int count = 0;    ///< since the newest one that could be used, or since the stream began
  std::string why;  ///< of the newest of them: "damaged: Premature end of JPEG file"
};

/// A camera. It streams only between Start() and Stop(). One thread calls everything but Interrupt().
class Camera {
 public:
  virtual ~Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  const CameraCapabilities& capabilities() const { return capabilities_; }

  /// Begins streaming; harmless when streaming already. Disconnected, Busy, Timeout, Protocol.
  Result<void> Start() { return Noted(DoStart()); }
  /// Ends streaming; harmless when not streaming.
  Result<void> Stop() { return Noted(DoStop()); }
  /// The newest frame not yet handed out, or none yet. Never waits for an exposure. A frame that cannot be used is none,
  /// and is told by unusable(). InvalidArgument: not streaming. Disconnected, Timeout, Protocol.
  Result<std::optional<Frame>> Poll() { return Noted(DoPoll()); }
  /// Whether the capabilities allow what `wanted` has; nothing is asked of the device. OutOfRange, with the range
  /// as far as it is known: outside it, or an exposure time not above 0. Unsupported: a gain where there is none.
  Result<void> Check(const ExposureState& wanted) const;
  /// Exposure time of the frames that start after this call, rounded to what the camera takes. Errors of Check();
  /// Unsupported, OutOfRange.
  Result<void> SetExposure(Duration exposure);
  /// Gain of the frames that start after this call, rounded likewise. Errors of Check(); Unsupported, OutOfRange.
  Result<void> SetGain(double gain);
  /// As the camera says it is set; what it does not say is left out.
  Result<ExposureState> ReadExposure() { return Noted(DoReadExposure()); }
  Counters counters() const { return DoCount(); }
  /// What Poll() has kept back.
  UnusableFrames unusable() const { return DoTellUnusable(); }
  /// From any thread: makes an I/O call in progress return Cancelled soon.
  void Interrupt() { DoInterrupt(); }

 protected:
  /// A focus region that few pixels make up grows about its middle: on small frames the default would be too little.
  explicit Camera(CameraCapabilities capabilities);
  /// Calls that ended with an error of the connection.
  std::uint64_t failed_calls() const { return failed_calls_; }
  /// For DoStart() and DoPoll(): a frame came that can be used, or the stream begins.
  void NoteUsable() { unusable_ = {}; }
  /// For DoPoll(): `count` frames came that cannot be used.
  void NoteUnusable(std::string why, int count = 1) { unusable_ = {unusable_.count + count, std::move(why)}; }

 private:
  virtual Result<void> DoStart() = 0;
  virtual Result<void> DoStop() = 0;
  virtual Result<std::optional<Frame>> DoPoll() = 0;
  virtual Result<void> DoSetExposure(Duration) { return Fail(Code::Unsupported, "this camera's exposure is fixed"); }
  /// Both: within the range of the capabilities, where that is known.
  virtual Result<void> DoSetGain(double) { return Fail(Code::Unsupported, "this camera's gain cannot be set"); }
  virtual Result<ExposureState> DoReadExposure() { return ExposureState{}; }
  virtual void DoInterrupt() {}
  /// What a driver counts, with failed_calls() among the bus errors.
  virtual Counters DoCount() const { return {.bus_errors = failed_calls_}; }
  virtual UnusableFrames DoTellUnusable() const { return unusable_; }

  template <class T>
  Result<T> Noted(Result<T> result) {
    if (!result && IsBusError(result.error().code)) ++failed_calls_;
    return result;
  }

  CameraCapabilities capabilities_;
  std::uint64_t failed_calls_ = 0;
  UnusableFrames unusable_;
};

}  // namespace lensd::drivers
