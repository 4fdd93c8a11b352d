// The curve's points, less the tiles too bright in any frame, and the judgement on its top. Nothing here asks for
// frames.
#include "autofocus/search/sharpness_curve.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "autofocus/peak_model.h"
#include "autofocus/sharpness.h"

namespace lensd::autofocus {
namespace {

constexpr double kClearProminence = 6.0;  ///< standard deviations of the noise
constexpr double kClearContrast = 0.1;    ///< of the peak over the rest of the range
constexpr double kMostLeftOut = 0.8;      ///< of the region, as too bright
constexpr double kWorthKeeping = 0.5;     ///< of the region: before more is left out of it, the margin shrinks
constexpr int kLeastClear = 1;            ///< px beside what is too bright: the sums of a tile reach so far
constexpr double kFlicker = 0.02;         ///< of sharpness: what changes from frame to frame besides noise
constexpr double kSigmas = 3.0;
constexpr int kFarther = 3, kFarthest = 9;  ///< times the reach: a coarse texture's top is level near by

constexpr double kNoiseEnergy = 0.375;  ///< FocusScore::gradient_energy of white noise of variance 1

/// More than `most` of the region.
bool TooMuch(const std::vector<char>& left_out, double most) {
  const auto out = static_cast<double>(std::ranges::count(left_out, 1));
  return out > most * static_cast<double>(left_out.size());
}

/// The finer passes crowd around the top, so not the median.
double LowerQuartile(std::vector<CurvePoint> points) {
  const auto quarter = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 4);
  std::ranges::nth_element(points, quarter, {}, &CurvePoint::value);
  return quarter->value;
}

std::vector<CurvePoint> Around(const std::vector<CurvePoint>& points, double centre, double reach) {
  std::vector<CurvePoint> near;
  for (const CurvePoint& point : points) {
    if (std::abs(point.position - centre) <= reach && point.value > 2 * point.sigma) near.push_back(point);
  }
  return near;
}

/// The end of the range where the top of the curve lies, if it does: there sharpness is level and then falls, while
/// short of a subject beyond the range it still climbs. Blur falls evenly with position, so a curve that climbs loses
/// about as much in its last step as in the one before.
std::optional<double> FlatEnd(const std::vector<CurvePoint>& points, double top, double step) {
  constexpr double kAsSharp = 0.97;
  constexpr double kLevel = 0.25;  ///< of the fall three steps away: straight would be a third, a parabola a ninth
  const auto flat = [&](const auto& begin, const auto& end) {
    const CurvePoint& last = *begin;
    const auto distance = [&](const CurvePoint& point) { return std::abs(point.position - last.position); };
    const auto next = std::find_if(begin, end, [&](const CurvePoint& point) { return distance(point) > 0.5 * step; });
    const auto off = std::find_if(begin, end, [&](const CurvePoint& point) { return distance(point) > 2.5 * step; });
    if (off == end || last.value < kAsSharp * top) return false;
    const double noise = kSigmas * std::hypot(last.sigma, next->sigma);
    return std::max(last.value - next->value, 0.0) + noise < kLevel * (last.value - off->value);
  };
  if (flat(points.begin(), points.end())) return points.front().position;
  if (flat(points.rbegin(), points.rend())) return points.back().position;
  return std::nullopt;
}

std::string Reason(double prominence, const PeakChoice* choice) {
  std::ostringstream reason;
  reason.precision(3);
  reason << "one peak in the range, " << prominence << " times the noise above the rest";
  if (choice != nullptr) {
    reason << ", best as a " << PeakModelName(choice->model);
    std::string separator = " (";
    for (std::size_t i = 0; i < kPeakModels.size(); ++i) {
      if (!choice->fits[i].rejected) continue;
      reason << separator << PeakModelName(kPeakModels[i]) << " rejected: F = " << choice->fits[i].f;
      separator = ", ";
    }
    if (separator == ", ") reason << ", limit " << choice->f_limit << ")";
  }
  reason << ", checked by a last frame";
  return reason.str();
}

}  // namespace

Why AtTheEndOf(const Setup& setup) {
  return {Cause::EndOfTravel,
          setup.ends == Setup::Ends::Travel
              ? "sharpest at the end of the travel: the subject may lie beyond what this lens reaches"
              : "sharpest at the end of the range asked for: the subject may lie beyond it; ask for a wider one"};
}

Verdict Refuse(Why why) {
  Verdict verdict;
  verdict.cause = why.cause;
  verdict.reason = why.reason;
  return verdict;
}

void SharpnessCurve::Add(const Look& look) {
  auto tiles = look.tiles;
  if (!tiles && look.frame != nullptr) tiles = ScoreTiles(*look.frame, look.window);
  samples_.push_back({look.position, look.position_sigma, look.score, std::move(tiles)});
}

/// By tile: too bright in some frame, or within a margin of that. Where that leaves too little, the tiles become
/// smaller, and the margin shrinks.
SharpnessCurve::Parts SharpnessCurve::WithoutClipped() const {
  Parts parts;
  if (samples_.empty() || !samples_.front().tiles) return parts;
  const auto leave_out = [&](int margin) {
    parts.left_out.assign(TilesOf(samples_.front(), parts).tiles.size(), 0);
    for (const CurveSample& sample : samples_) {
      const auto& tiles = TilesOf(sample, parts).tiles;
      for (std::size_t t = 0; t < tiles.size(); ++t) parts.left_out[t] |= tiles[t].clear < margin ? 1 : 0;
    }
  };
  leave_out(kMostClear);
  if (!TooMuch(parts.left_out, kMostLeftOut)) return parts;
  parts.finer = samples_.front().tiles->finer != nullptr;
  for (int margin = kMostClear; margin >= kLeastClear; --margin) {
    leave_out(margin);
    if (!TooMuch(parts.left_out, kWorthKeeping)) break;
  }
  return parts;
}

const TileScores& SharpnessCurve::TilesOf(const CurveSample& sample, const Parts& parts) {
  return parts.finer ? *sample.tiles->finer : *sample.tiles;
}

bool SharpnessCurve::Overexposed() const {
  return TooMuch(WithoutClipped().left_out, kMostLeftOut);
}

double SharpnessCurve::Noise(const Parts& parts) const {
  std::vector<FocusScore> scores;
  int pixels = 0;
  for (const CurveSample& sample : samples_) {
    scores.push_back(sample.tiles ? ScoreOf(TilesOf(sample, parts), parts.left_out, pixels) : sample.score);
  }
  if (samples_.empty() || !samples_.front().tiles) return NoiseVariance(scores, 8);
  return std::max(NoiseVariance(scores, samples_.front().tiles->bits), samples_.front().tiles->rounding);
}

std::vector<CurvePoint> SharpnessCurve::Taken() const {
  const Parts parts = WithoutClipped();
  const double noise = Noise(parts);
  const bool only_rounding = !samples_.empty() && samples_.front().tiles && noise <= samples_.front().tiles->rounding;
  std::vector<CurvePoint> points;
  for (const CurveSample& sample : samples_) {
    int pixels = 1;
    const FocusScore score = sample.tiles ? ScoreOf(TilesOf(sample, parts), parts.left_out, pixels) : sample.score;
    const Sharpness sharpness = SharpnessOf(score, noise, std::max(pixels, 1));
    // Rounding that no noise evens out may add anything up to twice its share, by what the picture is.
    const double uneven = only_rounding ? SharpnessOf({.mean = score.mean}, noise, 1).value : 0.0;
    points.push_back({sample.position, sharpness.value, std::hypot(sharpness.sigma, uneven), sample.position_sigma});
  }
  return points;
}

std::vector<CurvePoint> SharpnessCurve::Points() const {
  std::vector<CurvePoint> points = Taken();
  std::ranges::stable_sort(points, {}, &CurvePoint::position);
  return points;
}

std::vector<FrameEnergy> SharpnessCurve::Energies() const {
  const Parts used = WithoutClipped();
  const double noise = Noise(used);
  std::vector<FrameEnergy> energies;
  for (const CurveSample& sample : samples_) {
    if (!sample.tiles) return {};
    int pixels = 1;
    const FocusScore all = ScoreOf(*sample.tiles, {}, pixels);
    const Sharpness whole = SharpnessOf(all, noise, std::max(pixels, 1));
    const FocusScore left = ScoreOf(TilesOf(sample, used), used.left_out, pixels);
    energies.push_back({.whole = {sample.position, whole.value, whole.sigma},
                        .clipped = all.saturated_fraction,
                        .left = pixels * (left.gradient_energy - kNoiseEnergy * noise),
                        .beside = sample.tiles->around,
                        .noise = kNoiseEnergy * noise,
                        .light = left.mean,
                        .all_light = all.mean});
  }
  return energies;
}

bool SharpnessCurve::LeavesOut() const {
  return std::ranges::count(WithoutClipped().left_out, 1) > 0;
}

std::vector<PartPeak> SharpnessCurve::PartPeaks() const {
  constexpr int kTilesAlong = 2;       // of a part, at least
  constexpr int kMostParts = 8;        // along a side
  constexpr double kTextured = 0.15;   // of the mean over the parts: less says nothing
  constexpr double kClearRise = 8.0;   // standard deviations
  constexpr double kClearShare = 0.3;  // of the peak
  if (samples_.empty() || !samples_.front().tiles) return {};
  const Parts used = WithoutClipped();
  const TileScores& first = TilesOf(samples_.front(), used);
  const double noise = Noise(used);
  const int across = std::clamp(samples_.front().tiles->columns / kTilesAlong, 1, kMostParts);
  const int down = std::clamp(samples_.front().tiles->rows / kTilesAlong, 1, kMostParts);
  struct Part {
    CurvePoint top;
    CurvePoint dullest;
  };
  std::vector<Part> parts;
  double mean = 0.0;
  for (int part = 0; part < across * down; ++part) {
    std::vector<char> others = used.left_out;
    for (std::size_t t = 0; t < others.size(); ++t) {
      const int column = static_cast<int>(t) % first.columns, row = static_cast<int>(t) / first.columns;
      if (row * down / first.rows * across + column * across / first.columns != part) others[t] = 1;
    }
    if (std::ranges::count(others, 0) * 2 < static_cast<std::ptrdiff_t>(first.tiles.size()) / (across * down)) continue;
    std::vector<CurvePoint> points;
    for (const CurveSample& sample : samples_) {
      int pixels = 1;
      const FocusScore score = ScoreOf(TilesOf(sample, used), others, pixels);
      const Sharpness sharpness = SharpnessOf(score, noise, std::max(pixels, 1));
      points.push_back({sample.position, sharpness.value, sharpness.sigma, 0.0});
    }
    parts.push_back({*std::ranges::max_element(points, {}, &CurvePoint::value),
                     *std::ranges::min_element(points, {}, &CurvePoint::value)});
    mean += parts.back().top.value;
  }
  std::vector<PartPeak> peaks;
  for (const Part& part : parts) {
    const double rise = part.top.value - part.dullest.value;
    if (part.top.value < kTextured * mean / static_cast<double>(parts.size())) continue;
    if (rise < kClearRise * std::hypot(part.top.sigma, part.dullest.sigma) || rise < kClearShare * part.top.value)
      continue;
    peaks.push_back({part.top.position, std::min(1.0, part.top.value * static_cast<double>(parts.size()) / mean)});
  }
  std::ranges::stable_sort(peaks, {}, &PartPeak::position);
  return peaks;
}

std::vector<TexturePart> SharpnessCurve::Texture() const {
  if (samples_.empty() || !samples_.front().tiles) return {};
  const Parts used = WithoutClipped();
  const std::vector<char>& left_out = used.left_out;
  const int columns = TilesOf(samples_.front(), used).columns, rows = TilesOf(samples_.front(), used).rows;
  std::vector<TexturePart> parts;
  for (std::size_t t = 0; t < left_out.size(); ++t) {
    if (left_out[t] != 0) continue;
    const auto energy = [&](const CurveSample& sample) {
      const TileSum& tile = TilesOf(sample, used).tiles[t];
      return tile.gradient / tile.pixels;
    };
    const auto [dullest, sharpest] = std::ranges::minmax_element(samples_, {}, energy);
    const int column = static_cast<int>(t) % columns, row = static_cast<int>(t) / columns;
    parts.push_back({(column + 0.5) / columns, (row + 0.5) / rows, energy(*sharpest) - energy(*dullest)});
  }
  return parts;
}

SideSeen SeenOnSide(std::span<const CurvePoint> points, const CurvePoint& centre, double least, double most) {
  const auto [from, to] = std::minmax(least, most);
  SideSeen seen = SideSeen::Nothing;
  for (const CurvePoint& point : points) {
    const double off = point.position - centre.position;
    if (off < from || off > to) continue;
    const double clear = kSigmas * std::hypot(point.sigma, centre.sigma) + kFlicker * centre.value;
    if (point.value > centre.value + clear) return SideSeen::Sharper;
    if (point.value < centre.value - clear) seen = SideSeen::LessSharp;
    if (seen == SideSeen::Nothing) seen = SideSeen::Alike;
  }
  return seen;
}

double NearPx(const Setup& setup) {
  return *setup.blur_px * std::exp(std::min(0.0, setup.learned_log_factor));
}

SideReach ReachOfSides(const Setup& setup) {
  constexpr double kLeastPx = 2.5, kMostPx = 12.0, kWantedPx = 5.0;
  const double step = setup.resolution;
  if (!setup.blur_px) {
    const double range = setup.highest - setup.lowest;
    return {0.75 * step, range, std::max(0.02 * range, step)};
  }
  const double px = NearPx(setup);
  return {std::max(kLeastPx * px, 0.75 * step), std::max(kMostPx * px, 2.1 * step), std::max(kWantedPx * px, step)};
}

/// How well a top is known that lies between two frames clearly less sharp than it: a sixth of their distance, where
/// that is short enough.
std::optional<double> Between(const Setup& setup, const std::vector<CurvePoint>& points, std::size_t top) {
  constexpr double kMostPx = 9.0;
  if (!setup.blur_px) return std::nullopt;
  const auto less = [&](const CurvePoint& point) {
    const double off = point.position - points[top].position;
    return SeenOnSide({&point, 1}, points[top], off, off) == SideSeen::LessSharp;
  };
  const auto here = points.begin() + static_cast<std::ptrdiff_t>(top);
  const auto above = std::find_if(here, points.end(), less);
  const auto below = std::find_if(std::make_reverse_iterator(here), points.rend(), less);
  if (above == points.end() || below == points.rend()) return std::nullopt;
  const double distance = above->position - below->position;
  if (distance > std::max(kMostPx * *setup.blur_px, 3.2 * setup.resolution)) return std::nullopt;
  return distance / 6.0;
}

/// The top is one of the ends, or so near to one that noise and flicker may have put it there.
bool AtTheEnd(const Setup& setup, const std::vector<CurvePoint>& points, const CurvePoint& top) {
  const double near = setup.blur_px ? kHalfDepthOfFieldPx * *setup.blur_px : setup.resolution;
  for (const CurvePoint* end : {&points.front(), &points.back()}) {
    if (std::abs(end->position - top.position) > near) continue;
    const double clear = kSigmas * std::hypot(end->sigma, top.sigma) + kFlicker * top.value;
    if (end == &top || top.value - end->value < clear) return true;
  }
  return false;
}

std::optional<CurveTop> TopOf(const std::vector<CurvePoint>& points) {
  const auto top = std::ranges::max_element(points, {}, &CurvePoint::value);
  const double rest = LowerQuartile(points);
  const double above = top->value - rest;
  if (above < kClearProminence * top->sigma || above < kClearContrast * top->value) return std::nullopt;
  return CurveTop{static_cast<std::size_t>(top - points.begin()), above / top->sigma, rest};
}

Verdict JudgePeak(const Setup& setup, const SharpnessCurve& curve, const std::vector<CurvePoint>& points,
                  const CurveTop& top, double reach, double step) {
  const CurvePoint& highest = points[top.index];
  if (curve.Overexposed()) return Refuse(kTooBright);
  const double allowed = std::max(setup.blur_px ? kHalfDepthOfFieldPx * *setup.blur_px : 2 * step, setup.resolution);
  const bool at_end = AtTheEnd(setup, points, highest);
  Why trouble = AtTheEndOf(setup);
  std::string no_shape;  // `trouble` may refer to it
  std::optional<PeakChoice> peak;
  for (int farther = 1; farther <= kFarthest && !at_end && !peak; farther *= kFarther) {
    auto choice = ChoosePeak(Around(points, highest.position, farther * reach));
    const bool first = farther == 1;  // which says what is wrong
    if (!choice) {
      if (first) trouble = {Cause::Unclear, no_shape = std::move(choice.error())};
    } else if (kSigmas * choice->sigma > allowed) {
      if (first) trouble = {Cause::Unclear, "noise leaves open where the sharpest place is"};
    } else if (std::abs(choice->position - highest.position) > 2 * farther * step) {
      if (first) trouble = {Cause::Unclear, "the sharpest frames do not agree on one peak"};
    } else {
      peak = *choice;
    }
  }
  // Where no shape fits, less sharp frames near on both sides still hold the top between them.
  const auto between = peak || at_end ? std::nullopt : Between(setup, points, top.index);
  double position = 0.0, sigma = 0.5 * step;
  if (peak) {
    position = peak->position;
    sigma = peak->sigma;
    // A motor this coarse has a sharpest step, and none beside it is better.
    if (setup.blur_px && setup.resolution > 0.5 * allowed && std::abs(position - highest.position) < setup.resolution) {
      position = highest.position;
    }
  } else if (between) {
    position = highest.position;
    sigma = *between;
  } else {
    const auto end = FlatEnd(points, highest.value, step);
    if (!end) return Refuse(trouble);
    position = *end;
  }
  Verdict verdict;
  for (const double depth : SeveralDepths(setup, curve.PartPeaks(), highest.position)) {
    verdict.candidates.push_back({depth, 0.0, 0});
  }
  if (!verdict.candidates.empty()) {
    verdict.cause = kSeveralDepths.cause;
    verdict.reason = kSeveralDepths.reason;
    return verdict;
  }
  verdict.focused = true;
  verdict.position = std::clamp(position, setup.lowest, setup.highest);
  verdict.sigma = std::max(sigma, setup.resolution / std::sqrt(12.0));
  verdict.confidence = std::erf(allowed / (std::sqrt(2.0) * verdict.sigma));
  verdict.reason = Reason(top.prominence, peak ? &*peak : nullptr);
  return verdict;
}

}  // namespace lensd::autofocus
