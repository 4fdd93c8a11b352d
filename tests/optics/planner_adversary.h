// Seeded requests that are hard on a planner: exact ties, tangent limits, near-equal subjects, infinity, macro, limits
// at the hardware's ends, tolerances as large as the slack, open sides, stops, fixed planes, focusing past infinity.
#pragma once

#include <cstdint>

#include "optics/planner.h"

namespace lensd::optics::reference {

/// The request of this seed: the same one each time. Without diffraction.
PlanRequest AdversarialRequest(std::uint64_t seed);

/// All of it, for a failure message.
std::string Show(const PlanRequest& request);

}  // namespace lensd::optics::reference
