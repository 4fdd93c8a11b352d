// The options by which a lens and a focal plane are described on the command line, their exact numbers, and the two
// ways a distance that does not start at the lens centre becomes one that does.
#pragma once

#include <optional>
#include <string>

#include "cli/terminal/session.h"
#include "cli/text/quantity.h"
#include "optics/decimal.h"
#include "optics/focus_scale.h"
#include "optics/thin_lens.h"

namespace lensd::cli {

/// Close to the focal length an answer hangs on digits that the inputs lose when they are first rounded to doubles:
/// what is asked on the command line is computed on the decimals written there and rounded once, at the very end.
using optics::Rational;
using Place = optics::thin_lens::AxialPlace<Rational>;

Place PlaceOf(const Depth& depth);

/// The nearest double; OutOfRange beyond what doubles hold.
Result<double> Rounded(const Rational& exact);

/// `--focal-length`, > 0.
Result<Decimal> ParseFocalLength(const std::string& text);

/// Where distances on the command line start, as a scale of a lens with this gap between its principal planes.
optics::FocusScale ScaleOf(std::optional<From> from, Metres principal_gap = Metres{0.0});

/// The depth of a focal plane in metres from the lens centre; a distance may start elsewhere. Fails at and inside the
/// focal length, naming the closest focus: that of `longest_extension` where it is known.
Result<Depth> FocusFromCentre(const Decimal& focal_length, const Depth& focus, const optics::FocusScale& scale,
                              std::optional<Metres> longest_extension = std::nullopt);

/// The depth of an object while the sensor stands at `extension`, from the lens centre.
Result<Depth> ObjectFromCentre(const Decimal& focal_length, Metres extension, const Depth& object,
                               const optics::FocusScale& scale);

}  // namespace lensd::cli
