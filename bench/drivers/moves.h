// Readings, commands, stops and whole moves of one driver on its simulated device, timed and held to the device's
// truth.
#pragma once

#include <vector>

#include "bench/drivers/stand.h"

namespace lensd::bench {

/// Every single value, in the order measured. Times in ms.
struct DriverTimes {
  std::vector<double> bare_exchange, reading;
  std::vector<double> command;      ///< a motion is accepted
  std::vector<double> stop;         ///< Stop() returns: the device has been told
  std::vector<double> stop_travel;  ///< native steps from the call to where it rests
  std::vector<double> move;         ///< from the wish to "reached", by the rig that the daemon uses
  std::vector<double> travel;       ///< until the mechanism is there and stays, of the same moves
  std::vector<double> beyond;       ///< what the move took longer than the travel, move by move
  std::vector<double> error;        ///< of the position told then against the truth, native steps
};

/// As many of each as `count`. Whatever the device or the driver fails with.
Result<DriverTimes> TimeDriver(DriverStand& stand, int count);

/// How whole moves ended under a weather.
struct DriverOutcomes {
  int moves = 0;
  int within = 0;            ///< told reached, and it was
  int verified = 0;          ///< of these, told as measured
  int refused = 0;           ///< told as not reached, or failed, with a reason
  int false_reached = 0;     ///< told reached, and it was elsewhere
  std::vector<double> took;  ///< ms, all of them
};

Result<DriverOutcomes> MoveInWeather(DriverStand& stand, const Weather& weather, int moves);

}  // namespace lensd::bench
