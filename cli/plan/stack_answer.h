// A focus stack as JSON and in words.
#pragma once

#include <string>

#include "optics/stack.h"
#include "proto/json.h"

namespace lensd::cli {

/// `{feasible, shots: [{fNumber, extensionMm, nearD, farD, magnification}]}`, or `{feasible: false, reason}`.
proto::Json StackJson(const optics::StackAnswer& answer);
std::string StackText(const optics::StackAnswer& answer);

}  // namespace lensd::cli
