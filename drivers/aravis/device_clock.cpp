// Camera time to CLOCK_MONOTONIC from one latched pair. The error is half of what latching took, and is part of the
// frame's interval.
#include "device_clock.h"

#include <algorithm>

namespace lensd::drivers::aravis {

void DeviceClock::Latched(std::uint64_t device_ns, Instant before) {
  // The device read its clock after `before`: the difference is at least this, and a start computed from it is early
  // by no more than the command took.
  latched_ = before.time_since_epoch() - Duration(static_cast<Duration::rep>(device_ns));
}

ExposureInterval DeviceClock::IntervalOf(std::uint64_t device_ns, Instant arrival, Duration exposure, Duration slack) {
  if (!latched_ || meaning_ == StampMeaning::Nothing) return {arrival - exposure - slack, arrival};
  const Duration to_end = meaning_ == StampMeaning::ExposureStart ? exposure : Duration::zero();
  const Duration stamp(static_cast<Duration::rep>(device_ns));
  // No frame arrives before its exposure is over: one that seems to shows that the clocks have drifted apart.
  const Instant end = std::min(Instant{stamp + *latched_ + to_end}, arrival);
  return {end - exposure, end};
}

}  // namespace lensd::drivers::aravis
