// The daemon's answers for people.
#pragma once

#include <string>

#include "proto/json.h"

namespace lensd::cli {

/// A number with at most `digits` significant digits and its unit; "?" where it is null or absent.
std::string NumberText(const proto::Json& object, const char* key, int digits, const char* unit);
/// One line of LensInfo.
std::string InfoText(const proto::Json& info);
/// One line of LensStatus.
std::string StatusText(const proto::Json& status);
/// One line of MoveResult.
std::string MoveText(const proto::Json& move);
/// One line of AutofocusProgress, and of AutofocusStep, while it goes on.
std::string AutofocusProgressText(const proto::Json& progress);
std::string AutofocusStepText(const proto::Json& step);
/// One line of AutofocusResult, and one for each candidate.
std::string AutofocusText(const proto::Json& result);

}  // namespace lensd::cli
