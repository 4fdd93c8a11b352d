// Focus stacks: the fewest pictures that together make everything sharp.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "optics/plan_request.h"

namespace lensd::optics {

/// One picture of a stack.
struct StackShot {
  FNumber f_number;  ///< the same for all shots of a stack
  Metres extension;
  Dioptres near;  ///< of the asked-for depths, the stretch around the focal plane that this shot keeps sharp for
  Dioptres far;   ///< certain, tolerances included; neighbouring shots overlap or touch
  double magnification = 0;
};

/// Why there can be no stack.
enum class StackCause {
  TooFar,       ///< the farthest depth is out of reach
  TooNear,      ///< the nearest is
  Tolerance,    ///< it leaves nothing of the depth of focus
  Diffraction,  ///< at every f-number it exceeds a limit, or what tolerances leave of one
  TooMany,      ///< more shots than are counted
};
/// "tooFar".
std::string_view StackCauseName(StackCause cause);

/// The shots from far to near, or why there can be none.
struct StackAnswer {
  bool feasible = false;
  std::vector<StackShot> shots;
  StackCause cause = StackCause::TooMany;  ///< infeasible
  std::string reason;                      ///< the same in one line
};

/// Covers the sharp limits of `request` with the fewest shots at one common f-number; of equal counts the smallest
/// f-number. With a wavelength blur includes diffraction, and f-numbers at which the diffraction disk of a subject in
/// focus alone exceeds its limit are not used. Tolerances, ranges, stops and pupil factor count as they do in Plan().
/// InvalidArgument or OutOfRange for requests that make no sense, a blurred limit or a fixed focus among them. More
/// than 10,000 shots are reported as impossible. Pure: any thread, no state.
Result<StackAnswer> PlanStack(const PlanRequest& request);

}  // namespace lensd::optics
