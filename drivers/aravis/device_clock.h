// From a camera's own clock to ours: when a frame was exposed.
#pragma once

#include <cstdint>
#include <optional>

#include "base/clock.h"
#include "config.h"

namespace lensd::drivers::aravis {

/// When the camera exposed, as far as can be told. The start is never later than the truth: a frame must not claim to
/// show a lens that had not arrived yet.
struct ExposureInterval {
  Instant start{};
  Instant end{};
};

/// The difference between two clocks, known from moments when both were read (the camera's clock latched by a command)
/// and from frames, which cannot arrive before they were exposed. Not thread-safe.
class DeviceClock {
 public:
  explicit DeviceClock(StampMeaning meaning) : meaning_(meaning) {}

  /// Known from a latch.
  bool known() const { return latched_.has_value(); }
  /// The camera read its clock as `device_ns` at a time not before `before`.
  void Latched(std::uint64_t device_ns, Instant before);
  /// Nothing is known any more: the camera was restarted.
  void Forget() { latched_.reset(); }

  /// Of a frame stamped `device_ns` whose first packet came at `arrival`. Without a latch, or without a meaning of the
  /// stamp, the exposure is taken to have ended at arrival and to have begun up to `slack` (reading out the sensor)
  /// earlier than the exposure time says.
  ExposureInterval IntervalOf(std::uint64_t device_ns, Instant arrival, Duration exposure, Duration slack);

 private:
  StampMeaning meaning_;
  std::optional<Duration> latched_;  ///< host minus device, at the least
};

}  // namespace lensd::drivers::aravis
