// What is known of a lens, as charts: its curve of focus, its backlash.
#pragma once

#include <expected>

#include "cli/terminal/session.h"
#include "io/svg.h"
#include "varlink/json.h"

namespace lensd::cli {

/// The points of every curve of focus in a CalibrationInfo over native positions, as extension or as vergence,
/// whichever most points say, with the error of the extension. No: there is no curve.
std::expected<io::Chart, Failure> CalibrationChart(const varlink::Json& info);

/// What a BacklashResult that is known says: where the lens stands over where its motor was sent, up and back again,
/// and what the interval leaves open.
io::Chart BacklashChart(const varlink::Json& result);

}  // namespace lensd::cli
