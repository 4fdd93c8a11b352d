// How much fine detail a frame has around each pixel.
#pragma once

#include <limits>
#include <vector>

#include "merge/picture.h"

namespace lensd::merge {

/// One value a pixel.
using Plane = std::vector<float>;
inline constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// The luminance of a picture: its samples, or (R + 2 G + B)/4.
Plane LuminanceOf(const Picture& picture);

struct Sharpness {
  Plane detail;  ///< squares of what is finer than about three pixels
  Plane mean;    ///< the same as a mean around each pixel, about five pixels wide
  Plane light;   ///< the luminance without detail
};
Sharpness SharpnessOf(const Plane& luminance, int width, int height);

/// `plane`, of a frame of scale s, as the merged picture of scale S sees it, ratio = s/S <= 1: between pixels linear.
Plane Magnified(Plane plane, int width, int height, double ratio);

/// The mean of the middle part of a frame that the merged picture shows.
double SharedLight(const Plane& luminance, int width, int height, double ratio);

/// Means over squares of 2 radius + 1 pixels, the edge's pixels repeated beyond it.
Plane BoxMean(const Plane& plane, int width, int height, int radius);

}  // namespace lensd::merge
