// Samples may be wrong, and several wrong ones hide each other. So sets of samples that agree are looked for among many
// small ones (least trimmed squares; Rousseeuw 1984), what agrees with them is taken back, and the rest is left out
// where that makes the samples likelier than a surface and a scatter that explain all of them.
#include "autofocus/coordinate_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <string>
#include <utility>

#include "autofocus/algebra/convex_hull.h"
#include "autofocus/algebra/inverse.h"
#include "autofocus/surface/coordinate_guesses.h"

namespace lensd::autofocus {
namespace {

constexpr double kOutlierSigmas = 4.0;     ///< standard deviations: an outlier
constexpr double kSuspiciousSigmas = 2.5;  ///< off by that, samples are asked for outliers
constexpr double kOutlierChance = 0.02;    ///< of a sample, before anything is known
constexpr std::size_t kSpareSamples = 3;   ///< more than terms, before one may be left out
constexpr int kSubsets = 500, kRefits = 3;
constexpr double kEdge = 1e-9;  ///< of the range
using Rows = std::vector<std::vector<double>>;

std::string ShortNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

/// The weighted squares that samples are off the plane, or plane and bowl, through some of them.
std::optional<std::vector<double>> SquaresOff(const UsedSamples& all, const Rows& basis,
                                              const std::vector<std::size_t>& some) {
  const std::size_t count = basis[0].size();
  Rows normal(count, std::vector<double>(count, 0.0));
  std::vector<double> right(count, 0.0), squares;
  for (const std::size_t which : some) {
    const double weight = 1.0 / (all[which]->sigma * all[which]->sigma);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) normal[i][j] += weight * basis[which][i] * basis[which][j];
      right[i] += weight * basis[which][i] * (all[which]->focus - all[0]->focus);
    }
  }
  const auto inverse = InverseOf(std::move(normal), count, kSingularSurface);
  if (!inverse) return std::nullopt;
  for (std::size_t which = 0; which < all.size(); ++which) {
    double off = all[which]->focus - all[0]->focus;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) off -= basis[which][i] * (*inverse)[i][j] * right[j];
    }
    squares.push_back(std::pow(off / all[which]->sigma, 2));
  }
  return squares;
}

Rows BasisOf(const UsedSamples& all, const SurfaceFrame& frame, std::size_t bowls) {
  Rows basis;
  for (const auto* sample : all) {
    const auto place = ScaledPlace(frame, sample->at);
    basis.push_back({1.0});
    basis.back().insert(basis.back().end(), place.begin(), place.end());
    const double squares = std::inner_product(place.begin(), place.end(), place.begin(), 0.0);
    basis.back().insert(basis.back().end(), bowls, squares);
  }
  return basis;
}

/// Two thirds of the samples that agree best, by their numbers.
std::vector<std::size_t> CoreOf(const UsedSamples& all, const Rows& basis) {
  const std::size_t keep = all.size() - all.size() / 3;
  std::vector<std::size_t> order(all.size()), core;
  std::iota(order.begin(), order.end(), 0U);
  std::mt19937 random(1);
  double least = HUGE_VAL;
  for (int subset = 0; subset < kSubsets; ++subset) {
    for (std::size_t i = 0; i < basis[0].size(); ++i) std::swap(order[i], order[i + random() % (order.size() - i)]);
    std::vector<std::size_t> some(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(basis[0].size()));
    for (int refit = 0; refit < kRefits; ++refit) {
      const auto squares = SquaresOff(all, basis, some);
      if (!squares) break;
      some = order;
      std::ranges::sort(some, {}, [&](std::size_t which) { return (*squares)[which]; });
      some.resize(keep);
      double sum = 0.0;
      for (const std::size_t which : some) sum += (*squares)[which];
      if (sum < least) least = sum, core = some;
    }
  }
  return core;
}

/// By how many standard deviations a sample misses what the others say.
double SigmasOff(const CoordinateSurface& others, const SurfaceSample& sample) {
  const auto there = FocusOn(others, sample.at);
  return std::abs(sample.focus - there.focus) / std::hypot(there.sigma, sample.sigma, others.scatter);
}

struct Belief {
  std::vector<bool> used{};
  double evidence = -HUGE_VAL;
};

UsedSamples Chosen(const UsedSamples& all, const std::vector<bool>& used) {
  UsedSamples chosen;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (used[i]) chosen.push_back(all[i]);
  }
  return chosen;
}

/// From a core on: takes back the sample that is least off, while one agrees.
Belief Grow(const UsedSamples& all, const SurfaceFrame& frame, const std::vector<std::size_t>& core) {
  Belief belief{.used = std::vector<bool>(all.size(), false)};
  for (const std::size_t which : core) belief.used[which] = true;
  for (;;) {
    const auto judged = FitGuesses(Chosen(all, belief.used), frame);
    if (!judged) return {};
    std::size_t nearest = all.size(), out = 0;
    double least = kOutlierSigmas, farthest = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (belief.used[i]) continue;
      ++out;
      const double off = SigmasOff(judged->surface, *all[i]);
      farthest = std::max(farthest, std::abs(all[i]->focus - FocusOn(judged->surface, all[i]->at).focus));
      if (off < least) least = off, nearest = i;
    }
    if (nearest < all.size()) {
      belief.used[nearest] = true;
      continue;
    }
    belief.evidence = judged->evidence;
    if (out > 0) belief.evidence += static_cast<double>(out) * std::log(kOutlierChance / (2.0 * farthest));
    return belief;
  }
}

bool Suspicious(const UsedSamples& all, const CoordinateSurface& surface) {
  return std::ranges::any_of(all, [&](const SurfaceSample* sample) {
    return std::hypot(sample->focus - FocusOn(surface, sample->at).focus, surface.scatter) >
           kSuspiciousSigmas * sample->sigma;
  });
}

/// Names the outliers. `judged` is the surface through all.
void FindOutliers(std::vector<SurfaceSample>& samples, const UsedSamples& all, const SurfaceFrame& frame,
                  const JudgedSurface& judged) {
  const std::size_t terms = frame.low.size() + 1;
  if (all.size() < terms + kSpareSamples || all.size() < 3 || !Suspicious(all, judged.surface)) return;
  Belief best{.used = std::vector<bool>(all.size(), true), .evidence = judged.evidence};
  for (const std::size_t bowls : {0U, 1U}) {
    if (all.size() < terms + bowls + kSpareSamples) continue;
    const auto core = CoreOf(all, BasisOf(all, frame, bowls));
    if (core.empty()) continue;
    auto belief = Grow(all, frame, core);
    if (belief.used.empty()) continue;
    if (TellsCurvature(all, frame) && !TellsCurvature(Chosen(all, belief.used), frame)) continue;
    if (belief.evidence > best.evidence) best = std::move(belief);
  }
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].outlier = !best.used[i];
}

}  // namespace

std::vector<double> CoordinateSurface::Nearest(const std::vector<double>& at) const {
  const auto scaled = ScaledPlace({.low = low, .high = high}, at);
  const auto place = NearestBetween(places, scaled);
  if (place == scaled) return at;
  std::vector<double> nearest;
  for (std::size_t i = 0; i < at.size(); ++i) nearest.push_back(low[i] + 0.5 * (high[i] - low[i]) * (place[i] + 1.0));
  return nearest;
}

Result<SurfaceFocus> CoordinateSurface::At(const std::vector<double>& at) const {
  if (at.size() != low.size()) {
    return Fail(Code::InvalidArgument,
                "this surface has " + std::to_string(low.size()) + " coordinates, not " + std::to_string(at.size()));
  }
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double beyond = std::max(low[i] - at[i], at[i] - high[i]);
    if (beyond <= kEdge * (high[i] - low[i])) continue;
    return Fail(Code::OutOfRange, "coordinate " + std::to_string(i + 1) + " is " + ShortNumber(at[i]) + ", which is " +
                                      ShortNumber(beyond) + " outside the samples (" + ShortNumber(low[i]) + " to " +
                                      ShortNumber(high[i]) + "): focus there and add the sample");
  }
  if (Nearest(at) != at) {
    return Fail(Code::OutOfRange, "the place does not lie between the samples: focus there and add the sample");
  }
  return FocusOn(*this, at);
}

Result<CoordinateSurface> FitCoordinateSurface(std::vector<SurfaceSample>& samples) {
  for (auto& sample : samples) {
    sample.outlier = false;
    if (sample.at.empty() || sample.at.size() != samples[0].at.size() || !(sample.sigma > 0.0)) {
      return Fail(Code::InvalidArgument, "every sample needs the same coordinates and a sigma above zero");
    }
  }
  const std::size_t least = samples.empty() ? 1 : samples[0].at.size() + 1;
  if (samples.size() < least) {
    return Fail(Code::OutOfRange, "a focus surface takes at least " + std::to_string(least) + " samples and has " +
                                      std::to_string(samples.size()) + ": add " +
                                      std::to_string(least - samples.size()) + " more");
  }
  UsedSamples all, used;
  for (const auto& sample : samples) all.push_back(&sample);
  const auto frame = FrameOf(all);
  auto judged = FitGuesses(all, frame);
  if (judged) {
    FindOutliers(samples, all, frame, *judged);
    std::ranges::copy_if(all, std::back_inserter(used), [](const auto* sample) { return !sample->outlier; });
    if (used.size() < all.size()) judged = FitGuesses(used, FrameOf(used));
  }
  if (!judged) {
    return Fail(Code::OutOfRange,
                "the samples lie in too few places to show the slope along every coordinate: add one "
                "that is off their line");
  }
  for (auto& sample : samples) sample.off = sample.focus - FocusOn(judged->surface, sample.at).focus;
  return std::move(judged->surface);
}

}  // namespace lensd::autofocus
