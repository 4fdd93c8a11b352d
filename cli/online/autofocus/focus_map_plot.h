// A focus map as a drawing.
#pragma once

#include "io/svg.h"
#include "varlink/json.h"

namespace lensd::cli {

/// The frame as it lies in the picture, each region of a FocusMapResult in the colour of its best focus, with its
/// figure; and what was fitted.
io::Chart FocusMapChart(const varlink::Json& map);

}  // namespace lensd::cli
