// What is sharp around the plane in focus.
#pragma once

#include <optional>

#include "base/result.h"
#include "base/units.h"
#include "optics/object_depth.h"

namespace lensd::optics {

/// The vergences between which geometric blur is at most the limit; far is 0 where it reaches infinity.
struct DepthOfField {
  Dioptres near;
  Dioptres far;
};

/// Depth of field around `focus` for a blur limit C > 0: U = U_focus ± C N (1 - f U_focus)/f², cut at infinity.
/// OutOfRange when `focus` is at or inside the focal length; InvalidArgument for numbers that are not above zero.
Result<DepthOfField> DepthOfFieldAround(Metres focal_length, FNumber f_number, ObjectDepth focus, Metres blur_limit);

/// The nearest focus whose depth of field reaches infinity: exactly f + f²/(N C).
Metres Hyperfocal(Metres focal_length, FNumber f_number, Metres blur_limit);

}  // namespace lensd::optics
