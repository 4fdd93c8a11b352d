// Conditions of a search and shifts of focus, between the rig and the interface.
#pragma once

#include <string>

#include "base/result.h"
#include "rig/focus_shift.h"
#include "rig/search_conditions.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// SearchConditions. InvalidArgument: there is nothing in it, or what is in it makes no sense; its parameter begins
/// with `path`.
Result<rig::SearchConditions> SearchConditionsOf(const varlink::Json& json, const std::string& path);
/// SearchedUnder.
varlink::Json SearchedUnderJson(const rig::SearchedUnder& under);
/// FocusShift.
varlink::Json FocusShiftJson(const rig::FocusShift& shift);

}  // namespace lensd::daemon
