// A texture is brought to the grid along rows, then along columns; the frame and a margin are kept, what lies beyond is
// computed when asked for. Cells beyond the texture show its mirror image.
#include "sim/render/canvas.h"

#include <algorithm>
#include <array>
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

/// Where along a texture's rows or columns the picture's cells lie: cell boundary x at origin + x per_cell, in samples.
struct Along {
  double per_cell = 1.0;
  double origin = 0.0;
  bool moved = false;  ///< the picture has another size than the scene says

  double At(double x) const { return origin + x * per_cell; }
};

struct Tap {
  int index;
  double weight;
};

/// sin(pi x)/(pi x), tapered to 0 at 3 (Lanczos).
double TaperedSinc(double x) {
  constexpr double kReach = 3.0;
  if (std::abs(x) < 1e-9) return 1.0;
  if (std::abs(x) >= kReach) return 0.0;
  const double angle = std::numbers::pi * x;
  return std::sin(angle) / angle * std::sin(angle / kReach) / (angle / kReach);
}

/// Samples for cells that lie anywhere among them: band-limited, so that a picture that grows a little does not get
/// sharper here and softer there with each cell's place between two samples.
std::vector<Tap> MovedTapsOf(double centre, double per_cell, int size) {
  const double width = std::max(1.0, per_cell);
  std::vector<Tap> taps;
  double sum = 0.0;
  for (int sample = static_cast<int>(std::floor(centre - 3.0 * width)); sample + 0.5 < centre + 3.0 * width; ++sample) {
    const double weight = TaperedSinc((sample + 0.5 - centre) / width);
    if (weight == 0.0) continue;
    taps.push_back({Mirrored(sample, size), weight});
    sum += weight;
  }
  for (Tap& tap : taps) tap.weight /= sum;
  return taps;
}

/// Which samples of a texture's row or column make up cell `cell`: interpolated between two where the texture is
/// coarser than the grid, averaged over the cell where it is finer.
std::vector<Tap> TapsOf(int cell, const Along& along, int size) {
  if (along.moved) return MovedTapsOf(along.At(cell + 0.5), along.per_cell, size);
  std::vector<Tap> taps;
  if (along.per_cell <= 1.0) {
    const double at = along.At(cell + 0.5) - 0.5;
    const double first = std::floor(at);
    const double second_weight = at - first;
    taps.push_back({Mirrored(static_cast<int>(first), size), 1.0 - second_weight});
    if (second_weight > 0.0) taps.push_back({Mirrored(static_cast<int>(first) + 1, size), second_weight});
    return taps;
  }
  const double begin = along.At(cell);
  const double end = along.At(cell + 1);
  for (int sample = static_cast<int>(std::floor(begin)); sample < end; ++sample) {
    const double overlap = std::min(end, sample + 1.0) - std::max(begin, static_cast<double>(sample));
    if (overlap > 0.0) taps.push_back({Mirrored(sample, size), overlap / along.per_cell});
  }
  return taps;
}

struct Scales {
  Along x;
  Along y;
};

Scales ScalesOf(const TexturePaint& paint, int width, int height, double magnification) {
  Scales scales{{paint.texture_px_per_image_px}, {paint.texture_px_per_image_px}};
  if (paint.stretched) {
    scales = {{static_cast<double>(paint.texture->width) / width},
              {static_cast<double>(paint.texture->height) / height}};
  }
  if (magnification == 1.0) return scales;
  const auto magnify = [&](Along along, int size) {
    return Along{along.per_cell / magnification, 0.5 * size * along.per_cell * (1.0 - 1.0 / magnification), true};
  };
  return {magnify(scales.x, width), magnify(scales.y, height)};
}

/// One row of a texture brought to the grid's columns.
void FillLine(const Texture& texture, int row, const std::vector<std::vector<Tap>>& columns,
              std::vector<double>& line) {
  const float* samples = texture.light.data() + static_cast<std::ptrdiff_t>(row) * texture.width;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    double sum = 0.0;
    for (const Tap& tap : columns[i]) sum += tap.weight * static_cast<double>(samples[tap.index]);
    line[i] = sum;
  }
}

void FillTexture(const TexturePaint& paint, const Scales& scales, Raster& raster) {
  const Texture& texture = *paint.texture;
  std::vector<std::vector<Tap>> columns;
  for (int i = 0; i < raster.rect.width; ++i) {
    columns.push_back(TapsOf(raster.rect.x + i, scales.x, texture.width));
  }
  // Rows of the grid that follow each other share rows of the texture.
  struct Line {
    int row = -1;
    std::vector<double> light;
  };
  std::array<Line, 8> lines;
  for (Line& line : lines) line.light.resize(columns.size());
  std::vector<double> sums(columns.size());
  for (int y = raster.rect.y; y < raster.rect.y + raster.rect.height; ++y) {
    std::ranges::fill(sums, 0.0);
    for (const Tap& tap : TapsOf(y, scales.y, texture.height)) {
      Line& line = lines[static_cast<std::size_t>(tap.index) % lines.size()];
      if (line.row != tap.index) FillLine(texture, line.row = tap.index, columns, line.light);
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += tap.weight * line.light[i];
    }
    std::ranges::transform(sums, raster.Row(y), [](double sum) { return static_cast<float>(std::max(sum, 0.0)); });
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
    : Canvas(surface, camera.width, camera.height, 1.0) {}

Canvas::Canvas(const Surface& surface, int width, int height, double magnification)
    : surface_(surface), width_(width), height_(height), magnification_(magnification) {
  LayRegion();
  LayShape();
  LayPaint();
}

void Canvas::LayRegion() {
  const Region& region = surface_.region;
  const auto cell = [this](double fraction, int size) {
    const auto described = static_cast<int>(std::lround(fraction * size));
    if (described <= 0) return -kForEver;
    if (described >= size) return kForEver;
    return static_cast<int>(std::lround(Magnified(fraction * size, size)));
  };
  sides_.left = cell(region.x, width_);
  sides_.top = cell(region.y, height_);
  sides_.right = cell(region.x + region.w, width_);
  sides_.bottom = cell(region.y + region.h, height_);
  covers_all_ =
      sides_.left == -kForEver && sides_.top == -kForEver && sides_.right == kForEver && sides_.bottom == kForEver;
}

void Canvas::LayShape() {
  if (const auto* plane = std::get_if<PlaneShape>(&surface_.shape)) {
    const double ux = plane->ux_d / magnification_, uy = plane->uy_d / magnification_;
    plane_.slope_x = 2.0 * ux / width_;
    plane_.slope_y = 2.0 * uy / height_;
    plane_.origin = plane->u0_d - ux - uy;
    const double spread = std::abs(ux) + std::abs(uy);
    reach_.lowest = plane->u0_d - spread;
    reach_.highest = plane->u0_d + spread;
    return;
  }
  vergence_ = Raster(Grown({0, 0, width_, height_}, magnification_ == 1.0 ? 0 : kMargin));
  for (int y = vergence_.rect.y; y < vergence_.rect.y + vergence_.rect.height; ++y) {
    float* row = vergence_.Row(y);
    for (int x = 0; x < vergence_.rect.width; ++x) row[x] = DepthMapCell(vergence_.rect.x + x, y);
  }
  // Of the whole map: what the margin shows, and what lies beyond it.
  const auto& depths = std::get<DepthMapShape>(surface_.shape).depth->depth_m;
  const auto [low, high] = std::ranges::minmax_element(magnification_ == 1.0 ? vergence_.values : depths);
  reach_.lowest = static_cast<double>(magnification_ == 1.0 ? *low : 1.0f / *high);
  reach_.highest = static_cast<double>(magnification_ == 1.0 ? *high : 1.0f / *low);
}

float Canvas::DepthMapCell(int x, int y) const {
  const DepthMap& map = *std::get<DepthMapShape>(surface_.shape).depth;
  const auto sample = [this](int cell, int cells, int samples) {
    const double at = Unmagnified(cell + 0.5, cells) * samples / cells;
    return static_cast<std::size_t>(Mirrored(static_cast<int>(std::floor(at)), samples));
  };
  return 1.0f / map.depth_m[sample(y, height_, map.height) * static_cast<std::size_t>(map.width) +
                            sample(x, width_, map.width)];
}

void Canvas::LayPaint() {
  formula_ = !std::holds_alternative<TexturePaint>(surface_.paint);
  if (!formula_) light_ = TextureOver(Grown({0, 0, width_, height_}, kMargin));
}

Canvas::Phases Canvas::PhaseAt(double x, double y) const {
  const auto& wave = std::get<SinusoidPaint>(surface_.paint);
  const auto phase = [](double at, double period) {
    return period == 0.0 ? 0.0 : 2.0 * std::numbers::pi * at / period;
  };
  return {phase(Unmagnified(x, width_), wave.period_x_px), phase(Unmagnified(y, height_), wave.period_y_px)};
}

double Canvas::FormulaAt(double x, double y) const {
  if (std::holds_alternative<SinusoidPaint>(surface_.paint)) {
    const Phases phases = PhaseAt(x, y);
    return 0.5 + 0.5 * std::cos(phases.x) * std::cos(phases.y);
  }
  if (const auto* ramp = std::get_if<GradientPaint>(&surface_.paint)) {
    return ramp->left + (ramp->right - ramp->left) * Unmagnified(x, width_) / width_;
  }
  return std::get<ConstantPaint>(surface_.paint).light;
}

float Canvas::CellLight(int x, int y) const {
  if (formula_) return static_cast<float>(FormulaAt(x + 0.5, y + 0.5));
  if (light_.Holds(x, y)) return light_.At(x, y);
  return TextureOver({x, y, 1, 1}).values.front();
}

float Canvas::CellVergence(int x, int y) const {
  if (is_plane()) return static_cast<float>(PlaneVergence(x + 0.5, y + 0.5));
  if (vergence_.Holds(x, y)) return vergence_.At(x, y);
  if (magnification_ != 1.0) return DepthMapCell(x, y);
  return vergence_.At(Mirrored(x, width_), Mirrored(y, height_));
}

Raster Canvas::TextureOver(PixelRect rect) const {
  const auto& paint = std::get<TexturePaint>(surface_.paint);
  Raster light(rect);
  FillTexture(paint, ScalesOf(paint, width_, height_, magnification_), light);
  return light;
}

Raster Canvas::LightOver(PixelRect rect) const {
  return CopyOrFill(light_, rect, [this](float* out, int x, int y, int count) {
    if (count == 0) return;
    if (!formula_) {
      std::ranges::copy(TextureOver({x, y, count, 1}).values, out);
      return;
    }
    for (int i = 0; i < count; ++i) out[i] = CellLight(x + i, y);
  });
}

Raster Canvas::VergenceOver(PixelRect rect) const {
  return CopyOrFill(vergence_, rect, [this](float* out, int x, int y, int count) {
    for (int i = 0; i < count; ++i) out[i] = CellVergence(x + i, y);
  });
}

}  // namespace lensd::sim
