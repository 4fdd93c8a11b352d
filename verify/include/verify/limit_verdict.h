// Whether a picture keeps a limit of its blur, by the blur that was found slice by slice.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "verify/relative_blur.h"

namespace lensd::verify {

/// What was asked of the picture: the blur diameter of everything between two depths is at most (Sharp) or at least
/// (Blurred) so large.
struct BlurLimit {
  enum class Kind { Sharp, Blurred };
  std::string name = {};
  Kind kind = Kind::Sharp;
  double near_m = 0.0;
  double far_m = 0.0;  ///< may be infinite
  double limit_px = 0.0;
};

enum class Answer {
  Holds,       ///< no error bar reaches more than a tenth of the limit beyond it
  Broken,      ///< a whole error bar lies beyond the limit
  CannotTell,  ///< neither, or no slice in these depths has enough pixels
};

/// "holds", "broken" or "cannot tell".
std::string_view NameOf(Answer answer);

/// One limit over the slices that lie in it.
struct Verdict {
  BlurLimit limit;
  long pixels = 0;  ///< used in all of these slices
  std::optional<SliceBlur> worst =
      {};  ///< the slice whose likeliest blur is farthest on the wrong side; none: no slice
  Answer answer = Answer::CannotTell;
};

inline constexpr std::size_t kMostSlices = 1000;  ///< so that neither time nor memory grows without an end

/// The edges of slices of about `slice_m` > 0 from the nearest to the farthest depth of `depth_m` (0: unknown), with
/// both ends of every limit among them, so that no slice lies in a limit by half. Errors: BadData where no depth is
/// known, InvalidArgument where there would be more than kMostSlices slices.
Result<std::vector<double>> SliceEdges(std::span<const float> depth_m, std::span<const BlurLimit> limits,
                                       double slice_m);

/// The verdict over slices between the edges of SliceEdges(). A slice with fewer than kFewestPixels pixels does not
/// count.
Verdict Judge(const BlurLimit& limit, std::span<const SliceBlur> slices);

}  // namespace lensd::verify
