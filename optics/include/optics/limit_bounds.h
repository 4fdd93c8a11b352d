// One limit at one f-number: how much its depths are blurred, and at which extensions it holds. What the planner's
// report says and what a chart draws of a request.
#pragma once

#include <array>
#include <limits>

#include "optics/plan_request.h"

namespace lensd::optics {

/// Blur that counts as sharpness lost at a depth: with diffraction where the request has a wavelength. No tolerances.
Metres TotalBlurAt(const PlanRequest& request, const PlanDepth& depth, FNumber f_number, Metres extension);

/// The greatest blur (sharp, with diffraction) or the least (blurred, geometric, none on the wrong side).
struct WorstBlur {
  Metres blur;
  const PlanDepth* at = nullptr;  ///< the depth of the limit where that is
};
/// Over the tolerances of a request, which must outlive it, at one setting.
class WorstBlurs {
 public:
  WorstBlurs(const PlanRequest& request, FNumber f_number, Metres extension);
  /// At the limit's depths.
  WorstBlur Of(const BlurLimit& limit) const;

 private:
  WorstBlur Precisely(const BlurLimit& limit) const;

  const PlanRequest& request_;
  double f_, n_, e_, delta_;
  struct Kind {
    double behind, front;  ///< of factors of the blur, the one that makes it worse
    double sign;           ///< +1: the more the worse
    double n;              ///< the worst f-number of the tolerance
  };
  std::array<Kind, 3> kinds_;  ///< sharp, blurred behind, blurred in front
  bool plain_;                 ///< plain doubles may be enough
};

/// From `low` to `high`; empty where low > high.
struct HoldingExtensions {
  Metres low{-std::numeric_limits<double>::infinity()};
  Metres high{std::numeric_limits<double>::infinity()};
};
/// The extensions at which the limit holds at `f_number`, tolerances included, whatever the lens reaches. Depths of an
/// open side count as on that side of `focal_plane` on which most of them lie.
HoldingExtensions WhereHolds(const PlanRequest& request, const BlurLimit& limit, FNumber f_number,
                             Dioptres focal_plane);

}  // namespace lensd::optics
