// What the fast renderers work on, what each can do and how wrong it may be.
#pragma once

#include <stop_token>
#include <vector>

#include "sim/render/aperture_shape.h"
#include "sim/render/blur_line.h"
#include "sim/render/canvas.h"
#include "sim/render/pupil.h"
#include "sim/render/raster.h"

namespace lensd::sim {

/// One rendering task: the surfaces that can be seen, the state of the lens, the part of the frame.
struct View {
  const std::vector<Canvas>& canvases;
  BlurLine line;
  PixelRect region;
  const ApertureShape& shape;
  const Pupil& pupil;
  std::stop_token stop;  ///< once it came, what is left need not be rendered
};

/// The picture without blur: in each cell the nearest surface's light and vergence (0 where there is none).
struct SharpView {
  Raster light;
  Raster vergence;
};
SharpView SharpViewOver(const std::vector<Canvas>& canvases, PixelRect rect);

/// Largest |d| of any cell a renderer of this view may meet, in pixels.
double LargestBlur(const View& view);

/// How lively a picture is: the inputs of the error bounds.
struct Liveliness {
  double range = 0.0;      ///< largest less smallest light
  double variation = 0.0;  ///< mean difference of neighbours along x or y, of the liveliest 16 x 16 block
};
Liveliness LivelinessOf(const Raster& light);

/// Fourier: one wall with a formula for its paint. A disk of diameter b multiplies a sinusoid of frequency u by
/// 2 J1(pi b u) / (pi b u), a polygon by its own transform, and ramps and constants are left alone: exact.
bool CanFourier(const View& view);
Raster RenderFourier(const View& view);

/// Wall: one textured wall, one disk or even polygon: exact.
bool CanWall(const View& view);
Raster RenderWall(const View& view);

/// Gather: one surface over the whole picture; each pixel averages its own disk. Right where blur changes slowly: the
/// bound follows from how far the true kernel's rays land from the disk's, times how much the picture changes over
/// that. Circles and even polygons.
bool CanGather(const View& view);
double GatherBound(const View& view);
Raster RenderGather(const View& view);

/// Pupil: one textured wall through a pupil that is not perfect. The landing places of rays, through a fractional delay
/// each, add up to a kernel; where pupils change over the field there is one a node of a grid, mixed between nodes. The
/// bound is for what changes from one block of pixels to the next.
bool CanPupil(const View& view);
double PupilBound(const View& view);
Raster RenderPupil(const View& view);

/// Plane: one textured tilted plane over the whole picture; each pixel sums its own ellipse of light. A round
/// aperture, and not too steep: blur that changes by less than half a pixel a pixel.
bool CanPlane(const View& view);
double PlaneBound(const View& view);
Raster RenderPlane(const View& view);

/// Layers: walls only, circles and even polygons, blurred one by one and laid over each other, nearest on top. Exact
/// where every blurred outline is sharp, or what lies behind it is sharp or of one colour; elsewhere light and outline
/// behind the same part of the aperture are taken as unrelated, wrong by at most a quarter of the range of light.
bool CanLayers(const View& view);
double LayersBound(const View& view);
/// `doubtful`, if given, gets 1 in the pixels where the layers are not exact, else 0.
Raster RenderLayers(const View& view, Raster* doubtful = nullptr);

/// How many rays a pixel needs. A mean over rays is wrong by chance alone; its error is taken as what one pixel in a
/// thousand exceeds.
class RayBudget {
 public:
  /// `exactly`: that many everywhere. Otherwise as few as keep within the tolerance, at most `most`.
  RayBudget(const View& view, double tolerance, int most, bool exactly);
  int RaysFor(PixelRect part) const;
  /// Largest error over the view.
  double Bound() const;

 private:
  struct Need {
    double one_ray;  ///< error of a single ray
    double cells;    ///< of the largest disk
  };
  Need NeedOf(PixelRect part) const;
  static double ErrorOf(Need need, int rays);

  PixelRect region_;
  int margin_;
  double tolerance_;
  int most_;
  bool exactly_;
  Raster light_;
  Raster diameters_;
};

/// March: walls and depth maps, rays of neighbouring pixels in step (march.h).
bool CanMarch(const View& view);
Raster RenderMarch(const View& view, const RayBudget& budget);
/// Hybrid: layers, and rays in the pixels where those are doubtful.
Raster RenderHybrid(const View& view, const RayBudget& budget);

/// Splat: forward projection. Each cell spreads over its own disk on the sensor; on a tilted plane a point shows the
/// aperture's far and near side under different angles, the factor 1 + h . grad d. One surface on which nothing hides
/// anything.
bool CanSplat(const View& view);
Raster RenderSplat(const View& view);

/// Rays: the truth (ray_tracer.h).
Raster RenderRays(const View& view, const RayBudget& budget);

}  // namespace lensd::sim
