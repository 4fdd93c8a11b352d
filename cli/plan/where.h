// The little language of `--sharp` and `--blurred`: [NAME=]WHERE[:LIMIT][:behind|:front].
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "base/result.h"
#include "cli/text/quantity.h"
#include "optics/planner.h"

namespace lensd::cli {

/// A tilted plane in the scene: vergence u0 + ux x + uy y in dioptres, x and y in [-1, 1] across the frame.
struct TiltedPlane {
  Decimal u0, ux, uy;
};

/// Class K of the mask of a depth map, 1 to 255.
struct MaskClass {
  int number = 1;
};

/// One limit as written.
struct WrittenLimit {
  std::string name;  ///< empty: not given
  std::variant<DepthRange, TiltedPlane, MaskClass> where;
  std::optional<BlurSize> limit;  ///< empty: not given
  optics::Side side = optics::Side::Either;
};

/// Parses the value of `--sharp` or `--blurred`. A side is for blurred limits only.
Result<WrittenLimit> ParseLimit(std::string_view text, optics::LimitKind kind);

}  // namespace lensd::cli
