// One wall through a pupil that is not perfect: a kernel from rays, or a grid of them.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "sim/render/band_filter.h"
#include "sim/render/ray_tracer.h"
#include "sim/render/view.h"

namespace lensd::sim {
namespace {

constexpr int kTaps = 2 * kBandReach + 1;
constexpr int kPlaces = 64;          // a pixel, at which a ray is taken to land
constexpr double kCoarse = 8.0;      // px of blur from which four taps a side will do
constexpr int kLargestBlock = 8;     // px on a side that share a kernel
constexpr double kBlockShift = 0.2;  // px that landing places change, at most, over a block
constexpr double kBlockCut = 0.006;  // of the widest opening: the same of what a cat's eye moves
constexpr double kNodeShift = 0.4;   // ... and from node to node
constexpr double kNodeCut = 0.04;    // of the widest opening: what a cat's eye moves from node to node

/// Filters that give a band-limited picture a part of a pixel to the right of a sample: -1/2 .. 1/2.
const std::array<std::vector<double>, kPlaces + 1>& Delays() {
  static const auto kDelays = [] {
    std::array<std::vector<double>, kPlaces + 1> delays;
    for (int i = 0; i <= kPlaces; ++i) {
      const double part = static_cast<double>(i) / kPlaces - 0.5;
      delays[static_cast<std::size_t>(i)] = FilterWith([part](double w) { return std::polar(1.0, w * part); });
    }
    return delays;
  }();
  return kDelays;
}

/// Weights of the cells around a pixel, row-major, (2 reach + 1)^2.
struct RayKernel {
  int reach = 0;
  std::vector<float> weights;
};

class KernelMaker {
 public:
  KernelMaker(const View& view, double vergence_d) : view_(view), vergence_d_(vergence_d) {
    const double across = std::abs(view.line.At(vergence_d)) + 2.0 * view.pupil.Reach(vergence_d);
    reach_ = static_cast<int>(std::ceil(std::max(0.5, view.shape.reach()) * across)) + kBandReach + 1;
    rays_ = SpreadOverAperture(static_cast<int>(std::clamp(6.0 * across * across, 2500.0, 40000.0)), view.shape);
  }

  RayKernel At(FieldPoint at) const {
    const BlurLine line = view_.pupil.LineAt(view_.line, at);
    const double away = line.At(vergence_d_);
    const int side = 2 * reach_ + 1;
    std::vector<double> sums(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    for (const AperturePoint& h : rays_) {
      if (!view_.pupil.Passes(h, at)) continue;
      const AperturePoint off = view_.pupil.LandsOff(h, at);
      // A pixel sees through h what lies the other way.
      const double x = -h.x * away - off.x, y = -h.y * away - off.y;
      if (std::abs(away) < kCoarse) {
        Add(x, y, sums);
      } else {
        AddCoarse(x, y, sums);
      }
    }
    RayKernel kernel{reach_, std::vector<float>(sums.size())};
    const double each = 1.0 / static_cast<double>(rays_.size());
    for (std::size_t i = 0; i < sums.size(); ++i) kernel.weights[i] = static_cast<float>(each * sums[i]);
    return kernel;
  }

 private:
  /// Catmull-Rom: all that a wide kernel leaves of a picture is coarse enough for it.
  void AddCoarse(double x, double y, std::vector<double>& sums) const {
    const double column = std::floor(x), row = std::floor(y);
    const auto weights = [](double t) {
      return std::array{((-0.5 * t + 1.0) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0,
                        ((-1.5 * t + 2.0) * t + 0.5) * t, (0.5 * t - 0.5) * t * t};
    };
    const auto across = weights(x - column), down = weights(y - row);
    const int side = 2 * reach_ + 1;
    const int left = static_cast<int>(column) + reach_ - 1, top = static_cast<int>(row) + reach_ - 1;
    for (int j = 0; j < 4; ++j) {
      double* to = sums.data() + static_cast<std::ptrdiff_t>(top + j) * side + left;
      for (int i = 0; i < 4; ++i) to[i] += down[static_cast<std::size_t>(j)] * across[static_cast<std::size_t>(i)];
    }
  }

  void Add(double x, double y, std::vector<double>& sums) const {
    const double column = std::round(x), row = std::round(y);
    const auto place = [](double part) { return static_cast<std::size_t>(std::lround((part + 0.5) * kPlaces)); };
    const std::vector<double>& across = Delays()[place(x - column)];
    const std::vector<double>& down = Delays()[place(y - row)];
    const int side = 2 * reach_ + 1;
    const int left = static_cast<int>(column) + reach_ - kBandReach, top = static_cast<int>(row) + reach_ - kBandReach;
    for (int j = 0; j < kTaps; ++j) {
      double* to = sums.data() + static_cast<std::ptrdiff_t>(top + j) * side + left;
      for (int i = 0; i < kTaps; ++i) to[i] += down[static_cast<std::size_t>(j)] * across[static_cast<std::size_t>(i)];
    }
  }

  const View& view_;
  double vergence_d_;
  int reach_ = 0;
  std::vector<AperturePoint> rays_;
};

/// Fills `block` of the image.
void Sum(const RayKernel& kernel, const Raster& light, PixelRect block, Raster& image) {
  const int side = 2 * kernel.reach + 1;
  for (int y = block.y; y < block.y + block.height; ++y) {
    std::vector<float> sums(static_cast<std::size_t>(block.width));
    for (int row = 0; row < side; ++row) {
      const float* from = light.Row(y + row - kernel.reach) + (block.x - kernel.reach - light.rect.x);
      const float* weights = kernel.weights.data() + static_cast<std::ptrdiff_t>(row) * side;
      for (int column = 0; column < side; ++column) {
        const float weight = weights[column];
        if (weight == 0.0f) continue;
        for (int x = 0; x < block.width; ++x) sums[static_cast<std::size_t>(x)] += weight * from[column + x];
      }
    }
    std::ranges::copy(sums, image.Row(y) + (block.x - image.rect.x));
  }
}

double WallVergence(const View& view) {
  return view.canvases.front().PlaneVergence(0, 0);
}

/// px that a ray's landing place changes, at most, from a pixel to the next.
double ChangeOf(const View& view) {
  const double vergence_d = WallVergence(view);
  return view.pupil.ChangePerPx(vergence_d, std::abs(view.line.At(vergence_d)) + 2.0 * view.pupil.Reach(vergence_d));
}

/// px on a side over which one kernel will do.
int BlockOf(const View& view) {
  const double by_light = kBlockCut / std::max(view.pupil.CutPerPx(), 1e-9);
  return std::clamp(static_cast<int>(std::min(kBlockShift / ChangeOf(view), by_light)), 1, kLargestBlock);
}

/// Kernels at the nodes of a grid over the region, and between them.
class KernelGrid {
 public:
  KernelGrid(const View& view, double vergence_d) : region_(view.region) {
    spacing_ = std::max<double>(kLargestBlock, kNodeShift / ChangeOf(view));
    if (view.pupil.CutPerPx() > 0.0) spacing_ = std::min(spacing_, kNodeCut / view.pupil.CutPerPx());
    columns_ = static_cast<int>(std::ceil(region_.width / spacing_)) + 1;
    rows_ = static_cast<int>(std::ceil(region_.height / spacing_)) + 1;
    const KernelMaker maker(view, vergence_d);
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_ && !view.stop.stop_requested(); ++i) {
        kernels_.push_back(maker.At(view.pupil.FieldAt(region_.x + i * spacing_, region_.y + j * spacing_)));
      }
    }
  }

  RayKernel At(double x, double y) const {
    const double across = (x - region_.x) / spacing_, down = (y - region_.y) / spacing_;
    const int i = std::min(static_cast<int>(across), columns_ - 2), j = std::min(static_cast<int>(down), rows_ - 2);
    const auto right = static_cast<float>(across - i), lower = static_cast<float>(down - j);
    const auto node = [&](int column, int row) -> const std::vector<float>& {
      return kernels_[static_cast<std::size_t>(row * columns_ + column)].weights;
    };
    const auto &a = node(i, j), &b = node(i + 1, j), &c = node(i, j + 1), &d = node(i + 1, j + 1);
    RayKernel mixed{kernels_.front().reach, std::vector<float>(a.size())};
    for (std::size_t k = 0; k < a.size(); ++k) {
      mixed.weights[k] =
          (1.0f - lower) * ((1.0f - right) * a[k] + right * b[k]) + lower * ((1.0f - right) * c[k] + right * d[k]);
    }
    return mixed;
  }
  int reach() const { return kernels_.front().reach; }

 private:
  PixelRect region_;
  double spacing_ = 0.0;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<RayKernel> kernels_;
};

void RenderVarying(const View& view, Raster& image) {
  const KernelGrid grid(view, WallVergence(view));
  if (view.stop.stop_requested()) return;
  const PixelRect all = view.region;
  const Raster light = view.canvases.front().LightOver(Grown(all, grid.reach()));
  const int side = BlockOf(view);
  for (int y = all.y; y < all.y + all.height; y += side) {
    for (int x = all.x; x < all.x + all.width && !view.stop.stop_requested(); x += side) {
      const PixelRect block{x, y, std::min(side, all.x + all.width - x), std::min(side, all.y + all.height - y)};
      Sum(grid.At(x + 0.5 * block.width, y + 0.5 * block.height), light, block, image);
    }
  }
}

}  // namespace

bool CanPupil(const View& view) {
  if (view.pupil.is_perfect() || view.canvases.size() != 1) return false;
  const Canvas& canvas = view.canvases.front();
  return canvas.CoversAll() && canvas.is_wall() && std::holds_alternative<TexturePaint>(canvas.paint());
}

double PupilBound(const View& view) {
  constexpr double kLeft = 0.003;  // of full scale, by landing places rounded and rays counted
  if (view.pupil.is_uniform()) return kLeft;
  // From the middle of a block to its side, and from node to node, a landing place is off by so much on average, and
  // light there by what the neighbour's differs. A cat's eye cuts 1.27 times its move (the length of its sides) more or
  // less of the light, which is 0.6 of white where a picture is lively.
  const Liveliness lively = LivelinessOf(view.canvases.front().LightOver(view.region));
  const double change = ChangeOf(view);
  const double off = 0.25 * std::max(kBlockShift, change) + 0.06 * std::max(kNodeShift, kLargestBlock * change);
  return kLeft + 0.25 * off * lively.variation + 0.3 * 1.27 * view.pupil.CutPerPx() * BlockOf(view);
}

Raster RenderPupil(const View& view) {
  Raster image(view.region);
  if (!view.pupil.is_uniform()) {
    RenderVarying(view, image);
    return image;
  }
  const RayKernel kernel = KernelMaker(view, WallVergence(view)).At({});
  const Raster light = view.canvases.front().LightOver(Grown(view.region, kernel.reach));
  for (int y = view.region.y; y < view.region.y + view.region.height && !view.stop.stop_requested(); ++y) {
    Sum(kernel, light, {view.region.x, y, view.region.width, 1}, image);
  }
  return image;
}

}  // namespace lensd::sim
