// Reverse projection: what one point of the sensor sees of the scene through the whole aperture.
#pragma once

#include <optional>
#include <vector>

#include "aperture_shape.h"
#include "blur_line.h"
#include "canvas.h"

namespace lensd::sim {

/// At least `count` points spread evenly over the aperture, the same ones every time: a Fibonacci lattice in squared
/// radius and angle. The radius runs out and back in (the lattice is folded), which makes it periodic, so that smooth
/// pictures converge with the square of the count; others follow the lattice's low discrepancy.
std::vector<AperturePoint> SpreadOverAperture(int count, const ApertureShape& shape = {});

/// Follows rays through surfaces, nearest first. Where a ray meets a depth map from the side, between a near cell and a
/// farther one, the photograph does not say what is there: such rays are left out of the mean.
class RayTracer {
 public:
  /// Keeps a reference to `canvases`.
  RayTracer(const std::vector<Canvas>& canvases, BlurLine line, const ApertureShape& shape, int rays_per_pixel);

  /// Mean light over the aperture at a point of the sensor, in pixels.
  double LightAt(double x, double y) const;

 private:
  /// Light at the end of one ray; none where it meets the side of a depth map's cell.
  std::optional<double> Follow(double x, double y, AperturePoint point) const;

  const std::vector<Canvas>& canvases_;
  BlurLine line_;
  std::vector<AperturePoint> points_;
};

/// Whether nothing stands between the aperture point and the scene point of that place and vergence.
bool IsSeen(const std::vector<Canvas>& canvases, const BlurLine& line, double x, double y, double vergence_d,
            AperturePoint through);

}  // namespace lensd::sim
