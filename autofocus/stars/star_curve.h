// Half-flux radii of stars against the lens' position, and where they are least.
//
// A star's blur grows evenly with the way from its focus, and what blurs it at its focus too (pixels, aberrations,
// air) adds as squares do: HFR^2 = least^2 + slope^2 (x - x0)^2, a hyperbola. Its square is a parabola, whose vertex is
// a matter of linear least squares.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "autofocus/method.h"
#include "autofocus/stars.h"

namespace lensd::autofocus {

/// The stars of one frame.
struct StarLook {
  double position = 0.0;  ///< of the lens
  std::vector<Star> stars{};
};

struct HfrPoint {
  double position = 0.0;
  double hfr_px = 0.0;
  double sigma = 0.0;  ///< standard deviation of hfr_px, by noise alone
};

/// A star from frame to frame.
struct StarTrack {
  double x = 0.0, y = 0.0;  ///< where it was seen last
  std::vector<HfrPoint> points{};
};

/// Stars of frames in order of position, each followed while it drifts less than its own size from frame to frame.
std::vector<StarTrack> Follow(std::span<const StarLook> looks);
/// The track that the star goes on; nothing: none of them.
const StarTrack* TrackOf(const Star& star, std::span<const StarTrack> tracks);

struct HfrFit {
  double position = 0.0;  ///< where the HFR is least
  double sigma = 0.0;     ///< standard deviation of that: noise, and scatter beyond it
  double least_px = 0.0;  ///< the HFR there; 0: the curve is a V
  double slope = 0.0;     ///< px of HFR per position far away, > 0
  double At(double where) const;
};

/// `px`: the change of position that matters. Nothing: fewer than 5 points, no clear curve upward, or points that lie
/// on no hyperbola.
std::optional<HfrFit> FitHfr(std::span<const HfrPoint> points, double px);

/// A star whose curve is clear.
struct FittedStar {
  StarTrack track;
  HfrFit fit;
};
std::vector<FittedStar> FitStars(std::span<const StarTrack> tracks, double px);

/// Where the stars agree on their focus.
struct StarFocusPlace {
  double position = 0.0;
  double sigma = 0.0;
  double confidence = 0.0;             ///< that it is within half a depth of field
  std::vector<FittedStar> agreeing{};  ///< stars that have it there
  std::vector<double> several{};       ///< depths, where too many have it elsewhere
};
/// Nothing where no star is given.
std::optional<StarFocusPlace> AgreeOn(std::span<const FittedStar> stars, double px);

}  // namespace lensd::autofocus
