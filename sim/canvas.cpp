#include "canvas.h"

#include <algorithm>
#include <numbers>

namespace lensd::sim {
namespace {

constexpr int kMargin = 128;       // cells of texture kept ready around the frame
constexpr int kForEver = 1 << 24;  // further out than any blur reaches

/// Index into a row of `size` samples that continues as its own mirror image on both sides.
int Mirrored(int index, int size) {
  const int period = 2 * size;
  const int folded = ((index % period) + period) % period;
  return folded < size ? folded : period - 1 - folded;
}

struct Tap {
  int index;
  double weight;
};

/// Which samples of a texture's row or column make up cell `cell` when `scale` samples go to a cell: interpolated
/// between two where the texture is coarser than the grid, averaged over the cell where it is finer.
std::vector<Tap> TapsOf(int cell, double scale, int size) {
  std::vector<Tap> taps;
  if (scale <= 1.0) {
    const double at = (cell + 0.5) * scale - 0.5;
    const double first = std::floor(at);
    const double second_weight = at - first;
    taps.push_back({Mirrored(static_cast<int>(first), size), 1.0 - second_weight});
    if (second_weight > 0.0) taps.push_back({Mirrored(static_cast<int>(first) + 1, size), second_weight});
    return taps;
  }
  const double begin = cell * scale;
  const double end = (cell + 1) * scale;
  for (int sample = static_cast<int>(std::floor(begin)); sample < end; ++sample) {
    const double overlap = std::min(end, sample + 1.0) - std::max(begin, static_cast<double>(sample));
    if (overlap > 0.0) taps.push_back({Mirrored(sample, size), overlap / scale});
  }
  return taps;
}

struct Scales {
  double x;
  double y;
};

Scales ScalesOf(const TexturePaint& paint, int width, int height) {
  if (!paint.stretched) return {paint.texture_px_per_image_px, paint.texture_px_per_image_px};
  return {static_cast<double>(paint.texture->width) / width, static_cast<double>(paint.texture->height) / height};
}

float TextureCell(const Texture& texture, const std::vector<Tap>& columns, const std::vector<Tap>& rows) {
  double sum = 0.0;
  for (const Tap& row : rows) {
    const float* samples = texture.light.data() + static_cast<std::ptrdiff_t>(row.index) * texture.width;
    double line = 0.0;
    for (const Tap& column : columns) line += column.weight * static_cast<double>(samples[column.index]);
    sum += row.weight * line;
  }
  return static_cast<float>(sum);
}

void FillTexture(const TexturePaint& paint, Scales scales, Raster& raster) {
  const Texture& texture = *paint.texture;
  std::vector<std::vector<Tap>> columns;
  for (int i = 0; i < raster.rect.width; ++i) {
    columns.push_back(TapsOf(raster.rect.x + i, scales.x, texture.width));
  }
  for (int y = raster.rect.y; y < raster.rect.y + raster.rect.height; ++y) {
    const std::vector<Tap> rows = TapsOf(y, scales.y, texture.height);
    float* out = raster.Row(y);
    for (int i = 0; i < raster.rect.width; ++i)
      out[i] = TextureCell(texture, columns[static_cast<std::size_t>(i)], rows);
  }
}

/// Calls fill(out, x, y, count) for the pieces of `rect` outside `kept`, and copies the rest from it.
template <class Fill>
Raster CopyOrFill(const Raster& kept, PixelRect rect, Fill fill) {
  Raster result(rect);
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    float* out = result.Row(y);
    const bool row_kept = y >= kept.rect.y && y < kept.rect.y + kept.rect.height;
    const int from = row_kept ? std::clamp(kept.rect.x, rect.x, rect.x + rect.width) : rect.x + rect.width;
    const int to = row_kept ? std::clamp(kept.rect.x + kept.rect.width, from, rect.x + rect.width) : from;
    fill(out, rect.x, y, from - rect.x);
    if (to > from) std::copy_n(kept.Row(y) + (from - kept.rect.x), to - from, out + (from - rect.x));
    fill(out + (to - rect.x), to, y, rect.x + rect.width - to);
  }
  return result;
}

}  // namespace

Canvas::Canvas(const Surface& surface, const CameraSettings& camera)
    : surface_(surface), width_(camera.width), height_(camera.height) {
  LayRegion();
  LayShape();
  LayPaint();
}

void Canvas::LayRegion() {
  const Region& region = surface_.region;
  const auto cell = [](double fraction, int size) { return static_cast<int>(std::lround(fraction * size)); };
  left_ = cell(region.x, width_);
  top_ = cell(region.y, height_);
  right_ = cell(region.x + region.w, width_);
  bottom_ = cell(region.y + region.h, height_);
  if (left_ <= 0) left_ = -kForEver;
  if (top_ <= 0) top_ = -kForEver;
  if (right_ >= width_) right_ = kForEver;
  if (bottom_ >= height_) bottom_ = kForEver;
  covers_all_ = left_ == -kForEver && top_ == -kForEver && right_ == kForEver && bottom_ == kForEver;
}

void Canvas::LayShape() {
  if (const auto* plane = std::get_if<PlaneShape>(&surface_.shape)) {
    slope_x_ = 2.0 * plane->ux_d / width_;
    slope_y_ = 2.0 * plane->uy_d / height_;
    origin_ = plane->u0_d - plane->ux_d - plane->uy_d;
    const double spread = std::abs(plane->ux_d) + std::abs(plane->uy_d);
    min_vergence_ = plane->u0_d - spread;
    max_vergence_ = plane->u0_d + spread;
    return;
  }
  vergence_ = Raster({0, 0, width_, height_});
  const DepthMap& map = *std::get<DepthMapShape>(surface_.shape).depth;
  for (int y = 0; y < height_; ++y) {
    const int row = static_cast<int>((y + 0.5) * map.height / height_);
    for (int x = 0; x < width_; ++x) {
      const int column = static_cast<int>((x + 0.5) * map.width / width_);
      vergence_.Row(y)[x] = 1.0f / map.depth_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(map.width) +
                                               static_cast<std::size_t>(column)];
    }
  }
  const auto [low, high] = std::minmax_element(vergence_.values.begin(), vergence_.values.end());
  min_vergence_ = static_cast<double>(*low);
  max_vergence_ = static_cast<double>(*high);
}

void Canvas::LayPaint() {
  const auto* texture = std::get_if<TexturePaint>(&surface_.paint);
  formula_ = texture == nullptr;
  if (formula_) return;
  light_ = Raster(Grown({0, 0, width_, height_}, kMargin));
  FillTexture(*texture, ScalesOf(*texture, width_, height_), light_);
}

double Canvas::FormulaAt(double x, double y) const {
  if (const auto* wave = std::get_if<SinusoidPaint>(&surface_.paint)) {
    const auto factor = [](double at, double period) {
      return period == 0.0 ? 1.0 : std::cos(2.0 * std::numbers::pi * at / period);
    };
    return 0.5 + 0.5 * factor(x, wave->period_x_px) * factor(y, wave->period_y_px);
  }
  if (const auto* ramp = std::get_if<GradientPaint>(&surface_.paint)) {
    return ramp->left + (ramp->right - ramp->left) * x / width_;
  }
  return std::get<ConstantPaint>(surface_.paint).light;
}

float Canvas::CellLight(int x, int y) const {
  if (formula_) return static_cast<float>(FormulaAt(x + 0.5, y + 0.5));
  if (light_.Holds(x, y)) return light_.At(x, y);
  const auto& paint = std::get<TexturePaint>(surface_.paint);
  const Scales scales = ScalesOf(paint, width_, height_);
  return TextureCell(*paint.texture, TapsOf(x, scales.x, paint.texture->width),
                     TapsOf(y, scales.y, paint.texture->height));
}

float Canvas::CellVergence(int x, int y) const {
  if (is_plane()) return static_cast<float>(PlaneVergence(x + 0.5, y + 0.5));
  return vergence_.At(Mirrored(x, width_), Mirrored(y, height_));
}

Raster Canvas::LightOver(PixelRect rect) const {
  return CopyOrFill(light_, rect, [this](float* out, int x, int y, int count) {
    for (int i = 0; i < count; ++i) out[i] = CellLight(x + i, y);
  });
}

Raster Canvas::VergenceOver(PixelRect rect) const {
  return CopyOrFill(vergence_, rect, [this](float* out, int x, int y, int count) {
    for (int i = 0; i < count; ++i) out[i] = CellVergence(x + i, y);
  });
}

}  // namespace lensd::sim
