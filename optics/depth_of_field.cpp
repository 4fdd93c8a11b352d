#include "optics/depth_of_field.h"

#include <algorithm>
#include <cmath>

#include "optics/conjugates.h"

namespace lensd::optics {

Result<DepthOfField> DepthOfFieldAround(Metres focal_length, FNumber f_number, ObjectDepth focus, Metres blur_limit) {
  if (auto extension = FocusExtension(focal_length, focus); !extension) return PassOn(std::move(extension));
  const double tolerated = blur_limit.value * f_number.value;
  if (!(blur_limit.value > 0.0) || !(f_number.value > 0.0) || !std::isfinite(tolerated)) {
    return Fail(Code::InvalidArgument, "the blur limit and the f-number must be above zero");
  }
  const double f = focal_length.value;
  const double middle = focus.vergence().value;
  const double half = tolerated * focus.FocusGap(focal_length) / (f * f);
  return DepthOfField{{middle + half}, {std::max(0.0, middle - half)}};
}

Metres Hyperfocal(Metres focal_length, FNumber f_number, Metres blur_limit) {
  const double f = focal_length.value;
  return {f + f * f / (f_number.value * blur_limit.value)};
}

}  // namespace lensd::optics
