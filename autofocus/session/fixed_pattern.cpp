// By pixel, over the frames. Nothing here is asked for before a search has found no top.
#include "autofocus/session/fixed_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>

#include "autofocus/measures/tile_scores.h"
#include "autofocus/sharpness.h"

namespace lensd::autofocus {
namespace {

constexpr std::size_t kMostSamples = 16u << 20u;  ///< kept in all
constexpr std::size_t kLeastFrames = 6;
constexpr double kApartPx = 5.0;        ///< of blur, from frame to frame of those that show the pattern
constexpr double kApartShare = 0.05;    ///< of the range, where blur is not known
constexpr double kWorthwhile = 0.5;     ///< of the duller frames' gradient energy
constexpr double kHotSigmas = 6.0;      ///< beyond its neighbours: a hot pixel, whose noise is greater too
constexpr float kNothing = -1.0F;       ///< in the pattern
constexpr double kRoundingOf = 1.2;     ///< of a frame less the pattern, over that of a frame
constexpr double kCleanFull = 65535.0;  ///< full scale of a frame less the pattern

double FullScale(const drivers::Frame& frame) {
  return static_cast<double>((1u << frame.bits) - 1u);
}

Window Whole(const drivers::Frame& frame) {
  return {0, 0, frame.width, frame.height};
}

FocusScore ScoreOfWhole(const TileScores& tiles) {
  int pixels = 0;
  return ScoreOf(tiles, {}, pixels);
}

constexpr std::size_t kBlock = 64;        ///< pixels that are sorted side by side
using Block = std::array<float, kBlock>;  ///< of one frame

/// Each pixel's values over the frames in order: neighbours change places, by turns the even and the odd ones.
void SortByPixel(std::vector<Block>& values) {
  for (std::size_t turn = 0; turn < values.size(); ++turn) {
    for (std::size_t k = turn % 2; k + 1 < values.size(); k += 2) {
      for (std::size_t i = 0; i < kBlock; ++i) {
        const float less = std::min(values[k][i], values[k + 1][i]), more = std::max(values[k][i], values[k + 1][i]);
        values[k][i] = less;
        values[k + 1][i] = more;
      }
    }
  }
}

Block SumOf(std::span<const Block> values) {
  Block sum{};
  for (const Block& block : values) {
    for (std::size_t i = 0; i < kBlock; ++i) sum[i] += block[i];
  }
  return sum;
}

/// Each pixel less the median of the eight around it; the window's rim: 0.
std::vector<float> Apart(const std::vector<float>& pattern, int width, int height) {
  std::vector<float> apart(pattern.size(), 0.0F);
  std::array<float, 8> around{};
  for (int y = 1; y + 1 < height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      const float* pixel = pattern.data() + static_cast<std::ptrdiff_t>(y) * width + x;
      std::copy_n(pixel - width - 1, 3, around.begin());
      std::copy_n(pixel + width - 1, 3, around.begin() + 3);
      around[6] = pixel[-1];
      around[7] = pixel[1];
      std::ranges::nth_element(around, around.begin() + 4);
      apart[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          pixel[0] - around[4];
    }
  }
  return apart;
}

void MarkHotPixels(std::vector<float>& pattern, int width, int height) {
  const std::vector<float> apart = Apart(pattern, width, height);
  std::vector<float> sizes(apart.size());
  std::ranges::transform(apart, sizes.begin(), [](float value) { return std::abs(value); });
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::ranges::nth_element(sizes, middle);
  const double most = kHotSigmas * 1.4826 * static_cast<double>(*middle);
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (static_cast<double>(apart[i]) > most) pattern[i] = kNothing;
  }
}

/// Pixels that count for nothing become the mean of those beside them that do; `otherwise`: where there are none.
void FillIn(std::vector<std::uint16_t>& samples, const std::vector<float>& pattern, int width,
            std::uint16_t otherwise) {
  const auto size = static_cast<std::ptrdiff_t>(samples.size());
  for (std::ptrdiff_t p = 0; p < size; ++p) {
    if (pattern[static_cast<std::size_t>(p)] >= 0.0F) continue;
    std::uint32_t sum = 0, count = 0;
    for (const std::ptrdiff_t beside : {p - width, p - 1, p + 1, p + width}) {
      if (beside < 0 || beside >= size || pattern[static_cast<std::size_t>(beside)] < 0.0F) continue;
      sum += samples[static_cast<std::size_t>(beside)];
      ++count;
    }
    samples[static_cast<std::size_t>(p)] = count > 0 ? static_cast<std::uint16_t>(sum / count) : otherwise;
  }
}

}  // namespace

FixedPattern::Kept FixedPattern::CutOut(const drivers::Frame& frame, const Window& window) {
  Kept kept;
  auto samples = std::make_shared<std::vector<std::uint16_t>>();
  samples->reserve(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  for (int y = window.y; y < window.y + window.height; ++y) {
    const auto row = frame.samples->begin() + static_cast<std::ptrdiff_t>(y) * frame.width + window.x;
    samples->insert(samples->end(), row, row + window.width);
  }
  double sum = 0.0;
  for (const std::uint16_t sample : *samples) sum += sample;
  kept.light = std::max(sum / static_cast<double>(samples->size()), 1e-3);
  kept.window.width = window.width;
  kept.window.height = window.height;
  kept.window.bits = frame.bits;
  kept.window.samples = std::move(samples);
  return kept;
}

void FixedPattern::Keep(const Look& look) {
  if (full_ || look.on_the_way || look.frame == nullptr) return;
  const std::size_t size = static_cast<std::size_t>(look.window.width) * static_cast<std::size_t>(look.window.height);
  const bool other_size = !kept_.empty() && kept_.front().window.samples->size() != size;
  if (other_size || size * (kept_.size() + 1) > kMostSamples) {
    full_ = true;
    kept_.clear();
    return;
  }
  kept_.push_back(CutOut(*look.frame, look.window));
  if (look.tiles) kept_.back().around = look.tiles->around;
  kept_.back().position = look.position;
}

/// In order of position; searches crowd around what they take for the top, and the scene there is no pattern.
std::vector<std::size_t> FixedPattern::Spread(const Setup& setup) const {
  const double apart = setup.blur_px ? kApartPx * *setup.blur_px : kApartShare * (setup.highest - setup.lowest);
  std::vector<std::size_t> sorted(kept_.size());
  std::iota(sorted.begin(), sorted.end(), std::size_t{0});
  std::ranges::stable_sort(sorted, {}, [&](std::size_t i) { return kept_[i].position; });
  std::vector<std::size_t> spread;
  for (const std::size_t i : sorted) {
    if (spread.empty() || kept_[i].position - kept_[spread.back()].position >= apart) spread.push_back(i);
  }
  return spread;
}

/// The pattern, and of each of these frames the samples less what the others show.
std::vector<std::vector<std::uint16_t>> FixedPattern::FindPattern(std::span<const std::size_t> frames) {
  const std::size_t size = kept_.front().window.samples->size();
  pattern_.resize(size);
  std::vector<std::vector<std::uint16_t>> less(frames.size(), std::vector<std::uint16_t>(size));
  for (std::size_t first = 0; first < size; first += kBlock) FindBlock(frames, first, less);
  MarkHotPixels(pattern_, kept_.front().window.width, kept_.front().window.height);
  return less;
}

void FixedPattern::FindBlock(std::span<const std::size_t> frames, std::size_t first,
                             std::vector<std::vector<std::uint16_t>>& less) {
  const auto full = static_cast<std::uint16_t>(FullScale(kept_.front().window));
  const std::size_t pixels = std::min(kBlock, pattern_.size() - first);
  std::vector<Block> shown(frames.size());
  std::array<std::size_t, kBlock> at_full{};
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Kept& kept = kept_[frames[k]];
    const auto light = static_cast<float>(kept.light);
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::uint16_t sample = (*kept.window.samples)[first + i];
      shown[k][i] = sample / light;
      at_full[i] += sample >= full ? 1 : 0;
    }
  }
  std::vector<Block> sorted = shown;
  SortByPixel(sorted);
  const std::span<const Block> in_order = sorted;
  const std::size_t outer = frames.size() / 3, middle = frames.size() - 2 * outer;
  const Block sum = SumOf(in_order.subspan(outer, middle));
  for (std::size_t i = 0; i < pixels; ++i) {
    pattern_[first + i] = 2 * at_full[i] > frames.size() ? kNothing : sum[i] / static_cast<float>(middle);
  }
  // Without one of them, the middle third of the others begins and ends one place on, or has a gap.
  const std::size_t outer_of_others = (frames.size() - 1) / 3, count = frames.size() - 1 - 2 * outer_of_others;
  const Block sum_with_one = SumOf(in_order.subspan(outer_of_others, count + 1));
  const Block &least = sorted[outer_of_others], &most = sorted[outer_of_others + count];
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Kept& kept = kept_[frames[k]];
    for (std::size_t i = 0; i < pixels; ++i) {
      const float others = (sum_with_one[i] - std::clamp(shown[k][i], least[i], most[i])) / static_cast<float>(count);
      less[k][first + i] = Less((*kept.window.samples)[first + i], others, kept);
    }
  }
}

/// Of the gradient energy that the duller half of these frames shows.
double FixedPattern::ShareOf(std::span<const std::size_t> frames) const {
  std::vector<FocusScore> with, without;
  for (const std::size_t i : frames) {
    with.push_back(ScoreOfWhole(*ScoreTiles(kept_[i].window, Whole(kept_[i].window))));
    without.push_back(clean_[i].score);
  }
  const auto energies = [&](const std::vector<FocusScore>& scores) {
    const double noise = NoiseVariance(scores, kept_.front().window.bits);
    std::vector<double> values;
    for (const FocusScore& score : scores) values.push_back(std::max(SharpnessOf(score, noise, 1).value, 0.0));
    std::ranges::sort(values);
    return std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>((values.size() + 1) / 2), 0.0);
  };
  const double all = energies(with);
  return all > 0.0 ? 1.0 - energies(without) / all : 0.0;
}

bool FixedPattern::Find(const Setup& setup) {
  const auto frames = Spread(setup);
  if (frames.size() < kLeastFrames) return false;
  auto less = FindPattern(frames);
  clean_.clear();
  for (const Kept& kept : kept_) clean_.push_back(Scored(kept, Clean(kept)));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    clean_[frames[k]] = Scored(kept_[frames[k]], FilledIn(kept_[frames[k]], std::move(less[k])));
  }
  share_ = ShareOf(frames);
  if (share_ <= kWorthwhile) pattern_.clear();
  return known();
}

/// A sample without so much of the frame's light, in steps of a frame less the pattern.
std::uint16_t FixedPattern::Less(std::uint16_t sample, float pattern, const Kept& kept) {
  const double full = FullScale(kept.window);
  const double left = sample >= full ? full : sample + kept.light * static_cast<double>(1.0F - pattern);
  return static_cast<std::uint16_t>(std::lround(kCleanFull / full * std::clamp(left, 0.0, full)));
}

drivers::Frame FixedPattern::Clean(const Kept& kept) const {
  std::vector<std::uint16_t> samples(pattern_.size());
  for (std::size_t p = 0; p < samples.size(); ++p) samples[p] = Less((*kept.window.samples)[p], pattern_[p], kept);
  return FilledIn(kept, std::move(samples));
}

drivers::Frame FixedPattern::FilledIn(const Kept& kept, std::vector<std::uint16_t> samples) const {
  const double light = kept.light * kCleanFull / FullScale(kept.window);
  FillIn(samples, pattern_, kept.window.width, static_cast<std::uint16_t>(std::lround(light)));
  drivers::Frame clean = kept.window;
  clean.bits = 16;
  clean.samples = std::make_shared<std::vector<std::uint16_t>>(std::move(samples));
  return clean;
}

Look FixedPattern::Scored(const Kept& kept, const drivers::Frame& clean) {
  auto tiles = std::make_shared<TileScores>(*ScoreTiles(clean, Whole(clean)));
  tiles->bits = kept.window.bits;
  tiles->rounding = kRoundingOf * NoiseVariance({}, kept.window.bits);
  Look look;
  look.position = kept.position;
  look.window = Whole(clean);
  tiles->around = kept.around;
  look.tiles = std::move(tiles);
  look.score = ScoreOfWhole(*look.tiles);
  return look;
}

Look FixedPattern::Without(const Look& look) const {
  Kept kept = CutOut(*look.frame, look.window);
  if (look.tiles) kept.around = look.tiles->around;
  Look clean = Scored(kept, Clean(kept));
  clean.position = look.position;
  clean.position_sigma = look.position_sigma;
  clean.on_the_way = look.on_the_way;
  return clean;
}

drivers::Frame FixedPattern::PictureWithout(const drivers::Frame& frame, const Window& window) const {
  return Clean(CutOut(frame, window));
}

}  // namespace lensd::autofocus
