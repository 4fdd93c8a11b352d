// What an autofocus saw, as a chart.
#pragma once

#include "io/svg.h"
#include "varlink/json.h"

namespace lensd::cli {

/// Sharpness of every frame of an AutofocusResult over vergence, or over native positions where the optics are not
/// known, with the answer and twice its standard deviation, or why there is none.
io::Chart AutofocusChart(const varlink::Json& result);

}  // namespace lensd::cli
