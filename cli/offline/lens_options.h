// The options by which a lens and a focal plane are described on the command line, and the two ways a distance that
// does not start at the lens centre becomes one that does.
#pragma once

#include <optional>
#include <string>

#include "cli/exact_lens.h"
#include "cli/quantity.h"
#include "cli/session.h"

namespace lensd::cli {

/// `--focal-length`, > 0.
Result<Decimal> ParseFocalLength(const std::string& text);

/// The depth of a focal plane in metres from the lens centre; a distance may start elsewhere. Fails at and inside the
/// focal length, naming the closest focus.
Result<Depth> FocusFromCentre(const Decimal& focal_length, const Depth& focus, std::optional<From> from);

/// The depth of an object while the sensor stands at `extension`, from the lens centre.
Result<Depth> ObjectFromCentre(const Decimal& focal_length, Metres extension, const Depth& object,
                               std::optional<From> from);

}  // namespace lensd::cli
