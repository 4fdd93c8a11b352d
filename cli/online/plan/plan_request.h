// What a person typed of a plan, as type PlanRequest of io.lensd.Lens.
#pragma once

#include <optional>

#include "cli/plan/options.h"
#include "cli/terminal/session.h"
#include "varlink/json.h"

namespace lensd::cli {

/// Only what was typed: what is left out the daemon takes from the lens. Errors as ReadPlan().
Result<varlink::Json> TypedRequest(const PlanText& text, std::optional<From> from);

/// A refusal of such a request by lensd, which names a field of PlanRequest, in the words of lensctl.
Failure InWordsOfOptions(Failure refused);

}  // namespace lensd::cli
