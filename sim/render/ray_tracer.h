// Reverse projection: what a pixel of the sensor sees of the scene through the whole aperture.
#pragma once

#include <optional>
#include <vector>

#include "sim/render/aperture_shape.h"
#include "sim/render/blur_line.h"
#include "sim/render/canvas.h"
#include "sim/render/cell_light.h"
#include "sim/render/pupil.h"

namespace lensd::sim {

/// At least `count` points spread evenly over the aperture, the same ones every time: a Fibonacci lattice in squared
/// radius and angle. The radius runs out and back in (the lattice is folded), which makes it periodic, so that smooth
/// pictures converge with the square of the count; others follow the lattice's low discrepancy.
std::vector<AperturePoint> SpreadOverAperture(int count, const ApertureShape& shape = {});

/// One ray of a pixel: where it meets the sensor, in pixels from the pixel's middle, and the aperture.
struct PixelRay {
  AperturePoint on_sensor;
  AperturePoint through;
};

/// At least `count` rays spread evenly over the pixel and the aperture, the same ones every time: a lattice whose part
/// in the aperture is SpreadOverAperture's and whose places along the pixel's sides are evenly spaced.
std::vector<PixelRay> SpreadOverPixel(int count, const ApertureShape& shape);

/// How far from its pixel, in cells, a ray may meet something.
int RayReach(const std::vector<Canvas>& canvases, const BlurLine& line, const ApertureShape& shape,
             const Pupil& pupil = {});

/// Follows rays through surfaces, nearest first. Where a ray meets a depth map from the side, between a near cell and a
/// farther one, the photograph does not say what is there: such rays are left out of the mean.
class RayTracer {
 public:
  /// Keeps references to `pupil`, `canvases` and their light, which holds what the rays may meet.
  RayTracer(const std::vector<Canvas>& canvases, const std::vector<CellLight>& light, BlurLine line,
            const ApertureShape& shape, const Pupil& pupil, int rays_per_pixel);

  /// Mean light over a pixel and the aperture; what does not pass the pupil is dark.
  double LightAt(int x, int y) const;

 private:
  struct Seen;
  std::optional<Seen> FirstSeen(int x, int y, PixelRay pixel_ray, const BlurLine& line) const;
  double LightSeen(const Seen& seen, AperturePoint on_sensor) const;

  const std::vector<Canvas>& canvases_;
  const std::vector<CellLight>& light_;
  BlurLine line_;
  const Pupil& pupil_;
  std::vector<PixelRay> rays_;
};

/// Whether nothing stands between the aperture point and the scene point of that place and vergence.
bool IsSeen(const std::vector<Canvas>& canvases, const BlurLine& line, double x, double y, double vergence_d,
            AperturePoint through);

}  // namespace lensd::sim
