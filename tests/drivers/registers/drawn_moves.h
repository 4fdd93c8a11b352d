// Moves of drawn devices through a driver and a rig, on a stepped clock, judged by where the shaft truly was.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/api/lens.h"
#include "register_device.h"

namespace lensd::testing {

/// A lens of one axis, focus, whose registers are those of `device`; every question it asks takes `clock` time.
using MakeLens =
    std::function<std::unique_ptr<drivers::Lens>(RegisterDevice& device, SteppedClock& clock, std::mt19937_64& random)>;

struct MoveTally {
  long moves = 0, reached = 0, false_reached = 0, false_external = 0, failed = 0, stopped = 0, retargeted = 0, hung = 0;
  std::map<std::string, long> reasons;  ///< of those that failed
  std::vector<double> late_ms;          ///< of moves of devices that say the truth: the end said after the true one
};

/// `moves` of devices drawn from `seed`. One in some is stopped or sent elsewhere midway.
MoveTally RunDrawnMoves(const MakeLens& make, long moves, unsigned seed);
/// The same of devices that say the truth, and of ordinary moves alone.
MoveTally RunTruthfulMoves(const MakeLens& make, long moves, unsigned seed);
void Print(const char* what, MoveTally& tally);

}  // namespace lensd::testing
