// Limits whose distances start at the sensor: the depths they mean move with the extension, so that what is infeasible
// at one of them may be feasible at another.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/units.h"
#include "optics/plan_request.h"

namespace lensd::optics {

/// A request, not for a liquid lens, whose limits' distances start at the sensor, `behind` further from the lens centre
/// than the sensor distance. Its vergences and its focus are from the lens centre.
struct MovingRequest {
  PlanRequest request;
  Metres behind{0.0};
};

/// Whether any limit has a distance, other than infinity.
bool Moves(const PlanRequest& request);

/// An extension at which some f-number meets everything; nothing where there is none or none was found.
std::optional<Metres> ExtensionThatHolds(const MovingRequest& asked);

/// Names that no extension and f-number meet, wherever the sensor puts their depths: `conflict`, or what has to be
/// added to it. All there are where that cannot be shown. Where they are not named, f-numbers count from a thousandth
/// of the smallest on and extensions up to life size.
std::vector<std::string> MovingConflict(const MovingRequest& asked, const std::vector<std::string>& conflict);

}  // namespace lensd::optics
