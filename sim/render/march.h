// Rays of many neighbouring pixels followed in step.
//
// A ray through aperture point h lies, at vergence U, at p - h d(U). For pixels, which differ by whole cells, the rays
// from one place in the pixel through one h cross the same cells in the same order, shifted by the whole cells between
// them. So what a ray meets is one short programme per ray (walls at their vergence, depth-map cells while the ray is
// over them), and every pixel runs it with its own offset: a vector of pixels at a time, reading neighbouring cells.
#pragma once

#include <map>
#include <vector>

#include "sim/render/blur_line.h"
#include "sim/render/canvas.h"
#include "sim/render/raster.h"
#include "sim/render/ray_tracer.h"

namespace lensd::sim {

/// Whether every surface is a wall or a depth map: the rays of a tilted plane do not stay in step.
bool CanMarch(const std::vector<Canvas>& canvases);

/// Renders rectangles of one scene in one state of the lens by rays in step, the same rays RayTracer follows.
class March {
 public:
  /// Prepares `region`, whose parts may be asked for. CanMarch(canvases), and the pupil is uniform. The scene's cells
  /// are copied; `canvases` and `pupil` must outlive the march.
  March(const std::vector<Canvas>& canvases, BlurLine line, const ApertureShape& shape, const Pupil& pupil,
        PixelRect region);

  /// Fills `part` of `image`; the part lies in the region and in the image.
  void Render(PixelRect part, int rays_per_pixel, Raster& image);

  /// The surface cells of one step of a ray.
  struct Step {
    int layer;
    int offset_x;  ///< cells from the pixel
    int offset_y;
    float enter_d;  ///< vergence at which the ray comes over the cell
    float exit_d;   ///< and leaves it; a wall's own vergence for both
  };
  struct Layer {
    bool is_wall = false;
    CellLight light;  ///< of a wall: its mean is kAbsent outside its region
    Raster vergence;  ///< of a depth map; -infinity outside its region
  };
  /// Where a ray is: at vergence U at (x_px, y_px) + U (x_per_d, y_per_d) from the pixel's middle.
  struct Path {
    float x_px, y_px, x_per_d, y_per_d;
    bool is_centre;  ///< through the lens centre: shows the means of the cells it meets
  };
  static constexpr float kAbsent = -1e30f;

 private:
  /// What each ray of a bundle meets: those spread over pixel and aperture, then the one through the lens centre.
  struct Bundle {
    std::vector<Path> paths;
    std::vector<Step> steps;
    std::vector<int> first_step;  ///< of each ray; then the end
    double passing = 1.0;         ///< share of the rays, those that do not pass the pupil being left out
  };
  const Bundle& BundleOf(int rays_per_pixel);
  void AddProgramme(PixelRay ray, Bundle& bundle) const;

  const std::vector<Canvas>& canvases_;
  BlurLine line_;
  ApertureShape shape_;
  const Pupil& pupil_;
  int reach_;
  std::vector<Layer> layers_;
  std::map<int, Bundle> bundles_;  ///< by rays per pixel
};

}  // namespace lensd::sim
