// A FocusMapResult for people: what was found, and what to turn or shim.
#pragma once

#include <optional>
#include <string>

#include "base/units.h"
#include "varlink/json.h"

namespace lensd::cli {

/// Less is no finding: standard deviations.
inline constexpr double kClearSigmas = 3.0;

/// What a person reads. `between_shims`: how far apart shims at the lens' mount stand.
std::string FocusMapText(const varlink::Json& map, std::optional<Metres> between_shims);

/// How far from the common focus a region is in focus, in um, to a tenth and with its sign.
std::string OffsetText(double um);
/// A region of the map by its place: "column 2, row 1", from 1.
std::string CellName(const varlink::Json& cell);
/// "23.4 um (+- 0.8 um)"; "none beyond its error of 0.8 um" where it is less than three standard deviations.
std::string RiseText(const varlink::Json& tilt);
/// The same of the curvature; "not known" where too few regions tell.
std::string CurvatureText(const varlink::Json& surface);

}  // namespace lensd::cli
