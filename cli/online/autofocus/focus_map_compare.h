// Two focus maps with one change between them: what the change did, and what follows from it.
#pragma once

#include <optional>
#include <string>

#include "base/units.h"
#include "cli/terminal/session.h"
#include "varlink/json.h"

namespace lensd::cli {

/// A FocusMapResult as `lensctl focus-map --json` printed it. NoInput; BadData: no such thing, or a map that was
/// refused.
std::expected<varlink::Json, Failure> ReadFocusMap(const std::string& file);

/// Something that curvature may depend on has been moved by so much, above or below 0, since `before`: {changeUm,
/// sigmaUm, gain, gainSigma, moveUm, moveSigmaUm}, the last two null while the gain, or the curvature, is not known to
/// three standard deviations. Null where one of the maps has no curvature.
varlink::Json ProbeOf(const varlink::Json& before, const varlink::Json& map, Metres moved);
std::string ProbeText(const varlink::Json& probe);

/// The target has been turned half round in its own plane since `before`: {across, down}, each {cameraUm, targetUm,
/// sigmaUm}: what stayed, and what turned with it.
varlink::Json TurnedOf(const varlink::Json& before, const varlink::Json& map);
std::string TurnedText(const varlink::Json& turned);

}  // namespace lensd::cli
