// How many steps a reversal of focus loses, measured by looking: the same picture is sharpest at two different counts,
// depending on which side they were reached from.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "rig/rig.h"

namespace lensd::rig {

struct BacklashRequest {
  std::optional<drivers::Region> region;  ///< default: the camera's own
  int pairs = 5;                          ///< of sweeps, at least 3: more of them narrow the interval
};

/// Why backlash was not measured, or is not in force.
enum class BacklashCause { None, NotFocused, NoPeak, NoRoom, TooLarge, Unsteady, Missed, Configured };

struct BacklashOutcome {
  bool measured = false;
  Backlash backlash;  ///< where measured
  int frames = 0;     ///< those of autofocus included
  Duration elapsed{};
  BacklashCause cause = BacklashCause::None;
  std::string reason;  ///< why it was not measured
};

/// How far it has come.
struct BacklashProgress {
  int sweep = 0;  ///< from 1
  int of = 0;
  int frames = 0;
};

/// Focuses, then sweeps across the focus from below and from above in turn and compares where each sweep finds it. The
/// lens ends where autofocus found the subject. Newer commands of any caller end it (Superseded), as does a stop
/// (Cancelled). Unsupported: no camera, no focus axis. InvalidArgument: fewer than three pairs, a region outside the
/// frame. Call it, and destroy the rig, on the rig's thread; callbacks come from Rig::Step().
void MeasureBacklash(Rig& rig, const BacklashRequest& request, std::function<void(const BacklashProgress&)> progress,
                     std::move_only_function<void(Result<BacklashOutcome>)> done);

/// The mean of repeated measurements with its 95 % confidence interval: Student's t over their scatter, which is taken
/// to be at least `sigma` (what each is known to scatter by). At least two values.
Backlash BacklashFrom(const std::vector<double>& values, double sigma);

}  // namespace lensd::rig
