// How far focus is from where a search under other conditions finds it, measured by searching under both in turn.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "rig/rig.h"

namespace lensd::rig {

struct ShiftRequest {
  /// Of the first of the two searches of each pair: exactly one of f-number and filter, and the exposure that it takes.
  SearchConditions conditions{};
  std::optional<drivers::Region> region{};  ///< default: the camera's own
  int pairs = 5;                            ///< at least 3
};

/// How far it has come.
struct ShiftProgress {
  int search = 0;  ///< from 1
  int of = 0;
  int frames = 0;
};

struct ShiftOutcome {
  bool measured = false;
  FocusShift shift;  ///< where measured, but for `made`
  int frames = 0;
  Duration elapsed{};
  autofocus::Cause cause = autofocus::Cause::Unclear;  ///< of the search that refused
  std::string reason;                                  ///< why it was not measured
};

/// Searches (by `sweep`: depth from defocus ends a little off toward where it began, and not the same under both) under
/// the conditions and as the lens stands, in turn; what differs is the shift from the former to the latter. The lens
/// ends where focus was found last. Newer commands of any caller end it (Superseded), as does a stop (Cancelled).
/// InvalidArgument: fewer than three pairs, not exactly one of f-number and filter, or one that is no change. Otherwise
/// as Rig::Autofocus(). Call it, and destroy the rig, on the rig's thread; callbacks come from Rig::Step().
void MeasureFocusShift(Rig& rig, const ShiftRequest& request, std::function<void(const ShiftProgress&)> progress,
                       std::move_only_function<void(Result<ShiftOutcome>)> done);

}  // namespace lensd::rig
