// Each tile's sums are taken over the tile and one pixel around it, so that the tiles' inner pixels cover the window.
#include "autofocus/measures/tile_scores.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "autofocus/sharpness.h"

namespace lensd::autofocus {
namespace {

constexpr int kTileSide = 16;      // px, at least
constexpr int kFinerTileSide = 4;  // px, at least: clipped light may leave no larger parts
constexpr int kMostAlong = 40;     // tiles
constexpr int kAlone = 1;          // px at full scale are noise

bool AnyClipped(const drivers::Frame& frame, const Window& window, std::uint16_t full) {
  for (int y = window.y; y < window.y + window.height; ++y) {
    const auto row = frame.samples->begin() + static_cast<std::ptrdiff_t>(y) * frame.width + window.x;
    if (*std::max_element(row, row + window.width) >= full) return true;
  }
  return false;
}

/// Pixels at full scale in the tile and `around` it, as far as the window goes: more than noise.
bool ClippedWithin(const drivers::Frame& frame, const Window& window, const Window& tile, int around) {
  const auto full = static_cast<std::uint16_t>((1u << frame.bits) - 1u);
  const int top = std::max(tile.y - around, window.y), left = std::max(tile.x - around, window.x);
  const int bottom = std::min(tile.y + tile.height + around, window.y + window.height);
  const int right = std::min(tile.x + tile.width + around, window.x + window.width);
  int count = 0;
  for (int y = top; y < bottom; ++y) {
    const auto row = frame.samples->begin() + static_cast<std::ptrdiff_t>(y) * frame.width;
    count += static_cast<int>(std::count_if(row + left, row + right, [&](std::uint16_t v) { return v >= full; }));
  }
  return count > kAlone;
}

int ClearAround(const drivers::Frame& frame, const Window& window, const Window& tile) {
  int clear = kMostClear;
  while (clear > 0 && ClippedWithin(frame, window, tile, clear)) --clear;
  return clear;
}

/// Adds the pixels of `part` that lie inside the frame, without its outermost ones.
void AddPart(const drivers::Frame& frame, const Window& part, Band& band) {
  const int left = std::max(part.x - 1, 0), top = std::max(part.y - 1, 0);
  const int right = std::min(part.x + part.width + 1, frame.width);
  const int bottom = std::min(part.y + part.height + 1, frame.height);
  if (right - left < 3 || bottom - top < 3) return;
  const GreyView<std::uint16_t> view{frame.samples->data() + static_cast<std::ptrdiff_t>(top) * frame.width + left,
                                     right - left, bottom - top, frame.width};
  const auto full = static_cast<std::uint16_t>((1u << frame.bits) - 1u);
  band.energy += static_cast<double>(SumFocus(view, full).gradient) / (64.0 * full * full);
  band.pixels += static_cast<double>(right - left - 2) * (bottom - top - 2);
}

Bands BandsAround(const drivers::Frame& frame, const Window& window) {
  Bands bands;
  int inner = 0;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const int outer = kBandEndsPx[i], thick = outer - inner;
    const int width = window.width + 2 * outer, height = window.height + 2 * inner;
    AddPart(frame, {window.x - outer, window.y - outer, width, thick}, bands[i]);
    AddPart(frame, {window.x - outer, window.y + window.height + inner, width, thick}, bands[i]);
    AddPart(frame, {window.x - outer, window.y - inner, thick, height}, bands[i]);
    AddPart(frame, {window.x + window.width + inner, window.y - inner, thick, height}, bands[i]);
    inner = outer;
  }
  return bands;
}

std::shared_ptr<TileScores> ScoreTilesOf(const drivers::Frame& frame, const Window& window, int side) {
  auto scores = std::make_shared<TileScores>();
  const auto along = [side](int size) {
    return std::max(1, size / std::max(side, (size + kMostAlong - 1) / kMostAlong));
  };
  scores->columns = along(window.width);
  scores->rows = along(window.height);
  scores->bits = frame.bits;
  scores->full_scale = static_cast<double>((1u << frame.bits) - 1u);
  scores->rounding = NoiseVariance({}, frame.bits);
  const auto full = static_cast<std::uint16_t>(scores->full_scale);
  const bool some_clipped = AnyClipped(frame, window, full);
  for (int j = 0; j < scores->rows; ++j) {
    for (int i = 0; i < scores->columns; ++i) {
      Window tile{window.x + window.width * i / scores->columns, window.y + window.height * j / scores->rows, 0, 0};
      tile.width = window.x + window.width * (i + 1) / scores->columns - tile.x;
      tile.height = window.y + window.height * (j + 1) / scores->rows - tile.y;
      const int left = std::max(tile.x - 1, window.x), top = std::max(tile.y - 1, window.y);
      const int right = std::min(tile.x + tile.width + 1, window.x + window.width);
      const int bottom = std::min(tile.y + tile.height + 1, window.y + window.height);
      const GreyView<std::uint16_t> view{frame.samples->data() + static_cast<std::ptrdiff_t>(top) * frame.width + left,
                                         right - left, bottom - top, frame.width};
      const FocusSums sums = SumFocus(view, full);
      TileSum sum;
      sum.gradient = static_cast<double>(sums.gradient);
      sum.noise = static_cast<double>(sums.noise);
      sum.noise_pixels = static_cast<double>(sums.noise_pixels);
      sum.pixels = static_cast<double>(right - left - 2) * (bottom - top - 2);
      sum.light = static_cast<double>(sums.light) * sum.pixels / (static_cast<double>(right - left) * (bottom - top));
      sum.clear = some_clipped ? ClearAround(frame, window, tile) : kMostClear;
      scores->tiles.push_back(sum);
    }
  }
  return scores;
}

}  // namespace

std::shared_ptr<const TileScores> ScoreTiles(const drivers::Frame& frame, const Window& window) {
  auto scores = ScoreTilesOf(frame, window, kTileSide);
  scores->around = BandsAround(frame, window);
  auto finer = ScoreTilesOf(frame, window, kFinerTileSide);
  if (finer->tiles.size() > scores->tiles.size()) scores->finer = std::move(finer);
  return scores;
}

FocusScore ScoreOf(const TileScores& scores, const std::vector<char>& left_out, int& pixels) {
  TileSum all;
  double clipped = 0.0;
  for (std::size_t t = 0; t < scores.tiles.size(); ++t) {
    const TileSum& tile = scores.tiles[t];
    clipped += tile.clear < kMostClear ? 1.0 : 0.0;
    if (!left_out.empty() && left_out[t] != 0) continue;
    all.gradient += tile.gradient;
    all.noise += tile.noise;
    all.noise_pixels += tile.noise_pixels;
    all.light += tile.light;
    all.pixels += tile.pixels;
  }
  FocusScore score;
  pixels = static_cast<int>(all.pixels);
  if (all.pixels <= 0) return score;
  const double full = scores.full_scale;
  score.gradient_energy = all.gradient / (64.0 * full * full * all.pixels);
  score.noise = all.noise / (full * all.noise_pixels) * std::sqrt(0.5 * std::numbers::pi) / 6.0;
  score.saturated_fraction = clipped / static_cast<double>(scores.tiles.size());
  score.mean = all.light / (full * all.pixels);
  return score;
}

}  // namespace lensd::autofocus
