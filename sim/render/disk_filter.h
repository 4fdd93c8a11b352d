// Blur by one disk over a rectangle of the picture, by sums that every instruction set forms in the same order.
#pragma once

#include <vector>

#include "sim/render/disk_kernel.h"
#include "sim/render/raster.h"

namespace lensd::sim {

/// The running sums of a raster's rows, from which a row's sum over any run is one difference. The sums are of the
/// light less its mean, to stay small.
class SummedRaster {
 public:
  /// `cells` must outlive the sums. Sums all rows.
  explicit SummedRaster(const Raster& cells) : SummedRaster(cells, cells.rect.y, cells.rect.height) {}
  explicit SummedRaster(Raster&&) = delete;
  /// Sums `count` rows from row `first` on.
  SummedRaster(const Raster& cells, int first, int count);
  /// The same for other rows, in the same memory.
  void SumRows(int first, int count);

  const Raster& cells() const { return cells_; }
  float mean() const { return mean_; }
  /// Sum of the cells left of column x, less their mean, at Sums(y)[x - cells().rect.x]; one more than cells.
  const float* Sums(int y) const {
    return sums_.data() + static_cast<std::ptrdiff_t>(y - first_) * (cells_.rect.width + 1);
  }

 private:
  const Raster& cells_;
  float mean_ = 0.0f;
  int first_ = 0;
  std::vector<float> sums_;
};

/// Convolution with a disk's kernel, or that of an even polygon. Small disks cell by cell; larger ones
/// row by row: in each row the disk is a run of whole cells with partly covered ones at its ends, which the running
/// sums give in one difference a partly covered cell. The cost grows with the diameter, not with the area.
class DiskFilter {
 public:
  enum class Method { Auto, Direct, Runs };
  /// What Auto is for disks of that diameter.
  static Method MethodFor(double diameter_px);
  explicit DiskFilter(double diameter_px, Method method = Method::Auto, const ApertureShape& shape = {});
  /// `method` is not Auto. Weights may add up to anything.
  DiskFilter(const DiskKernel& kernel, Method method);

  int reach() const { return reach_; }
  Method method() const { return method_; }
  /// Fills `out`, whose rectangle grown by reach() lies within the source's.
  void Blur(const SummedRaster& source, Raster& out) const;
  /// The same from the cells alone: sums are formed band by band, in memory that stays in the cache.
  void Blur(const Raster& source, Raster& out) const;

  /// One weight of the kernel's upper right quadrant. Direct: of the cells (+-dx, +-dy). Runs: of the run from -dx to
  /// dx in rows +-dy.
  struct Tap {
    int dx;
    float weight;
  };

 private:
  void BlurRows(const SummedRaster& source, int first, int count, Raster& out) const;

  int reach_;
  Method method_;
  float sum_ = 0.0f;                    ///< of the weights
  std::vector<std::vector<Tap>> rows_;  ///< by dy = 0..reach
};

}  // namespace lensd::sim
