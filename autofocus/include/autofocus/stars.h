// Points of light in a frame, and how large they are: half-flux radius and full width at half maximum, as astronomers
// say it. Nothing of a lens is known here but that a point's light is all there, however far it is spread.
#pragma once

#include <optional>
#include <vector>

#include "autofocus/measures.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// One point of light.
struct Star {
  double x = 0.0;          ///< px from the frame's upper left corner: its centroid
  double y = 0.0;          ///< the same downward
  double flux = 0.0;       ///< above its background, in full scales of one pixel; less than it has where clipped
  double hfr_px = 0.0;     ///< radius of the circle about the centroid that holds half the flux
  double hfr_sigma = 0.0;  ///< standard deviation of that, by the noise of the background
  std::optional<double> fwhm_px{};  ///< of a Gaussian through its unclipped part; nothing: it has no such shape
  bool clipped = false;             ///< too bright for the sensor: its core is counted at full scale
  bool lone_pixel = false;          ///< one pixel holds nearly all of it, as a hot one does
};

/// The stars whose centre lies in the window, the brightest first, at most kMostStars. Left out are those that touch
/// the frame's edge, another star or something that is not round, and what does not stand out of the noise.
inline constexpr std::size_t kMostStars = 60;
std::vector<Star> FindStars(const drivers::Frame& frame, const Window& window);

/// What the stars of a frame come to.
struct StarFigures {
  int count = 0;
  int clipped = 0;                  ///< of these
  std::optional<double> hfr_px{};   ///< median over those that are not clipped
  std::optional<double> fwhm_px{};  ///< the same
};
StarFigures FiguresOf(const std::vector<Star>& stars);

}  // namespace lensd::autofocus
