// What a person typed of a plan, as type PlanRequest of io.lensd.Lens.
#pragma once

#include <optional>

#include "cli/plan/options.h"
#include "varlink/json.h"

namespace lensd::cli {

/// Only what was typed: what is left out the daemon takes from the lens. Errors as ReadPlan().
Result<varlink::Json> TypedRequest(const PlanText& text, std::optional<From> from);

}  // namespace lensd::cli
