// A focus stack as JSON and in words.
#pragma once

#include <string>

#include "optics/stack.h"
#include "varlink/json.h"

namespace lensd::cli {

/// `{feasible, shots: [{fNumber, extensionMm, nearD, farD, magnification}]}`, or `{feasible: false, reason}`.
varlink::Json StackJson(const optics::StackAnswer& answer);
/// In words: of this JSON, or of that of a daemon.
std::string StackText(const varlink::Json& stack);

}  // namespace lensd::cli
