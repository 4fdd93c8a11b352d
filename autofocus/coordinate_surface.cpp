// A sample is an outlier when the surface through all others misses it by far more than their errors allow; the worst
// goes first, then all are asked again. Scatter beyond the samples' own sigmas is estimated by asking that the weighted
// squares add up to their expectation (Paule and Mandel, 1982), and counts as error of each.
#include "autofocus/coordinate_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "inverse.h"

namespace lensd::autofocus {
namespace {

constexpr double kOutlierSigmas = 4.0;  ///< standard deviations: an outlier
constexpr double kBowlSigmas = 3.0;     ///< sigmas of the curvature
constexpr std::size_t kSpareSamples =
    3;  ///< samples more than terms, before one may be left out or a bowl be asked for
constexpr double kSingular = 1e-9;
using UsedSamples = std::vector<const SurfaceSample*>;
using TermMatrix = std::vector<std::vector<double>>;

std::vector<double> BasisOf(const CoordinateSurface& surface, const std::vector<double>& at) {
  std::vector<double> basis{1.0};
  double squares = 0.0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double half = 0.5 * (surface.high[i] - surface.low[i]);
    basis.push_back((at[i] - surface.low[i]) / half - 1.0);
    squares += basis.back() * basis.back();
  }
  if (surface.curved) basis.push_back(squares);
  return basis;
}

std::string ShortNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

SurfaceFocus FocusOn(const CoordinateSurface& surface, const std::vector<double>& at) {
  const auto basis = BasisOf(surface, at);
  double focus = 0.0, variance = 0.0;
  for (std::size_t i = 0; i < basis.size(); ++i) {
    focus += basis[i] * surface.terms[i];
    for (std::size_t j = 0; j < basis.size(); ++j) variance += basis[i] * surface.covariance[i][j] * basis[j];
  }
  return {focus, std::sqrt(std::max(0.0, variance))};
}

/// The weighted squares beyond what is expected of them; nothing: the samples do not determine the surface.
std::optional<double> SolveSurface(CoordinateSurface& surface, const UsedSamples& samples, double scatter2) {
  const std::size_t count = surface.low.size() + (surface.curved ? 2 : 1);
  TermMatrix normal(count, std::vector<double>(count, 0.0));
  std::vector<double> right(count, 0.0);
  for (const auto* sample : samples) {
    const auto basis = BasisOf(surface, sample->at);
    const double weight = 1.0 / (sample->sigma * sample->sigma + scatter2);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) normal[i][j] += weight * basis[i] * basis[j];
      right[i] += weight * basis[i] * sample->focus;
    }
  }
  auto inverse = InverseOf(std::move(normal), count, kSingular);
  if (!inverse) return std::nullopt;
  surface.covariance = *std::move(inverse);
  surface.terms.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) surface.terms[i] += surface.covariance[i][j] * right[j];
  }
  double squares = 0.0;
  for (const auto* sample : samples) {
    squares +=
        std::pow(sample->focus - FocusOn(surface, sample->at).focus, 2) / (sample->sigma * sample->sigma + scatter2);
  }
  return squares - (static_cast<double>(samples.size()) - static_cast<double>(count));
}

std::optional<CoordinateSurface> FitOne(const UsedSamples& samples, std::size_t extra) {
  CoordinateSurface surface{.low = samples[0]->at, .high = samples[0]->at, .curved = extra > 0};
  for (const auto* sample : samples) {
    for (std::size_t i = 0; i < sample->at.size(); ++i) {
      surface.low[i] = std::min(surface.low[i], sample->at[i]);
      surface.high[i] = std::max(surface.high[i], sample->at[i]);
    }
  }
  for (std::size_t i = 0; i < surface.low.size(); ++i) {
    if (!(surface.high[i] > surface.low[i])) return std::nullopt;
  }
  const auto excess = SolveSurface(surface, samples, 0.0);
  if (!excess) return std::nullopt;
  if (*excess <= 0.0 || samples.size() <= surface.terms.size()) return surface;
  double low = 0.0, high = 0.0;
  for (const auto* sample : samples) high += std::pow(sample->focus - FocusOn(surface, sample->at).focus, 2);
  high *= static_cast<double>(samples.size());
  constexpr int kHalvings = 50;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const auto more = SolveSurface(surface, samples, middle);
    if (!more) return std::nullopt;
    (*more > 0.0 ? low : high) = middle;
  }
  if (!SolveSurface(surface, samples, high)) return std::nullopt;
  surface.scatter = std::sqrt(high);
  return surface;
}

/// A bowl where it shows, else a plane.
std::optional<CoordinateSurface> FitBest(const UsedSamples& samples) {
  if (samples.size() >= samples[0]->at.size() + 2 + kSpareSamples) {
    const auto bowl = FitOne(samples, 1);
    if (bowl && std::abs(bowl->terms.back()) > kBowlSigmas * std::sqrt(bowl->covariance.back().back())) return bowl;
  }
  return FitOne(samples, 0);
}

UsedSamples Kept(const std::vector<SurfaceSample>& samples, const SurfaceSample* without) {
  UsedSamples kept;
  for (const auto& sample : samples) {
    if (!sample.outlier && &sample != without) kept.push_back(&sample);
  }
  return kept;
}

/// The sample that the surface through all others misses by most, if that is far; null: none.
SurfaceSample* WorstOf(std::vector<SurfaceSample>& samples) {
  SurfaceSample* worst = nullptr;
  double most = kOutlierSigmas;
  for (auto& sample : samples) {
    if (sample.outlier) continue;
    const auto others = FitBest(Kept(samples, &sample));
    if (!others) continue;
    const auto there = FocusOn(*others, sample.at);
    const double far = std::abs(sample.focus - there.focus) / std::hypot(there.sigma, sample.sigma, others->scatter);
    if (far > most) most = far, worst = &sample;
  }
  return worst;
}

}  // namespace

Result<SurfaceFocus> CoordinateSurface::At(const std::vector<double>& at) const {
  if (at.size() != low.size()) {
    return Fail(Code::InvalidArgument,
                "this surface has " + std::to_string(low.size()) + " coordinates, not " + std::to_string(at.size()));
  }
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (at[i] >= low[i] && at[i] <= high[i]) continue;
    const double beyond = at[i] < low[i] ? low[i] - at[i] : at[i] - high[i];
    return Fail(Code::OutOfRange, "coordinate " + std::to_string(i + 1) + " is " + ShortNumber(at[i]) + ", which is " +
                                      ShortNumber(beyond) + " outside the samples (" + ShortNumber(low[i]) + " to " +
                                      ShortNumber(high[i]) + "): focus there and add the sample");
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
  const std::size_t may_go = samples.size() / 3;
  for (std::size_t gone = 0; gone < may_go && samples.size() - gone >= least + kSpareSamples; ++gone) {
    SurfaceSample* worst = WorstOf(samples);
    if (worst == nullptr) break;
    worst->outlier = true;
  }
  const auto surface = FitBest(Kept(samples, nullptr));
  if (!surface) {
    return Fail(Code::OutOfRange,
                "the samples lie in too few places to tell the slope along every coordinate: add one "
                "that is off their line");
  }
  for (auto& sample : samples) sample.off = sample.focus - FocusOn(*surface, sample.at).focus;
  return *surface;
}

}  // namespace lensd::autofocus
