// A focus stack as a picture.
#pragma once

#include <string>

#include "io/svg.h"
#include "varlink/json.h"

namespace lensd::cli {

/// The depths that each shot keeps sharp, one row a shot. `stack` is feasible: that of StackJson, or of a daemon;
/// `lens` names the lens in the title.
io::Chart StackChart(const varlink::Json& stack, const std::string& lens);

}  // namespace lensd::cli
