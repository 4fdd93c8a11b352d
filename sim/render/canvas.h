// A surface laid on the sensor's grid: what light and what depth each cell of the picture shows.
//
// Textures are resampled once, one value a cell: the mean over the cell of a band-limited picture. disk_kernel.h says
// what blur does to such means, cell_light.h what rays see between them. Sinusoids and ramps keep their formula
// wherever a renderer can use it.
#pragma once

#include <cmath>
#include <vector>

#include "sim/render/raster.h"
#include "sim/scene.h"

namespace lensd::sim {

/// One surface on the picture's grid. The picture continues beyond the frame: textures and depth maps mirrored,
/// formulas as they are, and a region's side that lies on the frame's edge runs on for ever.
class Canvas {
 public:
  /// Keeps what the surface points to alive.
  Canvas(const Surface& surface, const CameraSettings& camera);
  /// The same surface in a picture `magnification` times as large, about the frame's middle. Outlines of regions stay
  /// between cells.
  Canvas Magnified(double magnification) const { return Canvas(surface_, width_, height_, magnification); }
  double magnification() const { return magnification_; }

  /// Light of the cell in column x, row y; any integers.
  float CellLight(int x, int y) const;
  /// Light at a point of the picture, in pixels from the frame's upper left corner.
  double LightAt(double x, double y) const {
    if (formula_) return FormulaAt(x, y);
    return CellLight(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
  }
  /// Of a sinusoid's two factors at a point of the picture, in radians.
  struct Phases {
    double x;
    double y;
  };
  Phases PhaseAt(double x, double y) const;
  /// Whether the surface's region holds the cell.
  bool Covers(int x, int y) const {
    return x >= sides_.left && x < sides_.right && y >= sides_.top && y < sides_.bottom;
  }
  bool CoversAll() const { return covers_all_; }
  /// The region as cells; sides that run on for ever are far outside the frame.
  PixelRect region() const { return {sides_.left, sides_.top, sides_.right - sides_.left, sides_.bottom - sides_.top}; }

  bool is_plane() const { return std::holds_alternative<PlaneShape>(surface_.shape); }
  bool is_wall() const { return is_plane() && plane_.slope_x == 0.0 && plane_.slope_y == 0.0; }
  /// Vergence of a plane at a point of the picture, and its slopes per pixel.
  double PlaneVergence(double x, double y) const { return plane_.origin + plane_.slope_x * x + plane_.slope_y * y; }
  double slope_x() const { return plane_.slope_x; }
  double slope_y() const { return plane_.slope_y; }
  /// Vergence of the cell's centre (plane) or of the whole cell (depth map).
  float CellVergence(int x, int y) const;
  /// Of all cells of the frame.
  double min_vergence() const { return reach_.lowest; }
  double max_vergence() const { return reach_.highest; }

  const Paint& paint() const { return surface_.paint; }

  /// Copies a part of the picture, cells outside the region included.
  Raster LightOver(PixelRect rect) const;
  Raster VergenceOver(PixelRect rect) const;

 private:
  /// Of the region, in cells.
  struct Sides {
    int left, top, right, bottom;
  };
  /// Vergence at the picture's corner, and per pixel.
  struct Plane {
    double origin = 0.0, slope_x = 0.0, slope_y = 0.0;
  };
  struct Reach {
    double lowest = 0.0, highest = 0.0;
  };

  Canvas(const Surface& surface, int width, int height, double magnification);
  /// Where a point of the picture, along x or y, is in the picture of magnification 1, and the other way.
  double Unmagnified(double at, int size) const {
    return magnification_ == 1.0 ? at : 0.5 * size + (at - 0.5 * size) / magnification_;
  }
  double Magnified(double at, int size) const {
    return magnification_ == 1.0 ? at : 0.5 * size + (at - 0.5 * size) * magnification_;
  }
  double FormulaAt(double x, double y) const;
  float DepthMapCell(int x, int y) const;
  Raster TextureOver(PixelRect rect) const;
  void LayRegion();
  void LayPaint();
  void LayShape();

  Surface surface_;
  int width_;
  int height_;
  double magnification_;
  Sides sides_;
  bool covers_all_ = false;
  bool formula_ = false;
  Raster light_;     ///< of a texture: one period of the mirrored picture where that is short, else frame and margin
  Raster vergence_;  ///< of a depth map, the frame
  Plane plane_;
  Reach reach_;
};

}  // namespace lensd::sim
