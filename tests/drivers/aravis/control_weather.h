// What befalls the control packets of the camera that this process plays: the executable's own sendmsg() loses, delays
// and changes them, which GLib then calls.
#pragma once

#include <atomic>

namespace lensd::testing {

/// In percent of the packets; and how many it befell.
struct ControlWeather {
  std::atomic<int> lost = 0;       ///< of commands and of answers
  std::atomic<int> late = 0;       ///< of answers,
  std::atomic<int> late_ms = 0;    ///< at most so late
  std::atomic<int> falsified = 0;  ///< of answers to what was read
  std::atomic<long> all_lost = 0, all_late = 0, all_falsified = 0;
};
ControlWeather& Weather();

}  // namespace lensd::testing
