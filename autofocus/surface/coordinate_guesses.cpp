// Focus over the samples is a plane with a random smooth surface on it (kriging; Matheron 1969), whose size, with that
// of the samples' scatter, is not known. So all sizes on a grid are asked, each counts as far as the samples are likely
// by it, and an answer is as sure as all of them together: where the samples do not tell curvature, that is not very
// sure.
#include "autofocus/surface/coordinate_guesses.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "autofocus/algebra/inverse.h"

namespace lensd::autofocus {
namespace {

constexpr int kSizes = 6;             ///< of bend and of scatter, beside none
constexpr double kNoneToOne = 2.5;    ///< how much likelier none is than one of them, before anything is known
constexpr double kLeastSize = 0.3;    ///< of the least sigma
constexpr double kMostSigmas = 10.0;  ///< the spread of focus is taken for that at least
constexpr double kFloor = 1e-6;       ///< of the spread: a standard deviation below it is that
constexpr double kThird = 0.5, kFourth = 0.25;  ///< variance of the third and fourth powers beside the squares
constexpr double kLeastWeight = 1e-4;
constexpr double kCurved = 0.95;
using Rows = std::vector<std::vector<double>>;

double Dot(const std::vector<double>& one, const std::vector<double>& two) {
  return std::inner_product(one.begin(), one.end(), two.begin(), 0.0);
}

double Covariance(const SurfaceGuess& guess, const std::vector<double>& one, const std::vector<double>& two) {
  const double dot = Dot(one, two);
  return guess.bowl * Dot(one, one) * Dot(two, two) + guess.bend * dot * dot * (1.0 + dot * (kThird + dot * kFourth));
}

/// In place, without pivots, as a covariance with a border needs none; the logarithm of its determinant's size.
std::optional<double> Invert(Rows& m) {
  double logarithm = 0.0;
  for (std::size_t k = 0; k < m.size(); ++k) {
    const double pivot = m[k][k];
    if (!(std::abs(pivot) > 0.0)) return std::nullopt;
    logarithm += std::log(std::abs(pivot));
    m[k][k] = 1.0;
    for (double& value : m[k]) value /= pivot;
    for (std::size_t i = 0; i < m.size(); ++i) {
      if (i == k) continue;
      const double factor = std::exchange(m[i][k], 0.0);
      for (std::size_t j = 0; j < m.size(); ++j) m[i][j] -= factor * m[k][j];
    }
  }
  return logarithm;
}

/// Fills in what the samples make of a guess; its weight is still a logarithm.
bool Judge(SurfaceGuess& guess, const Rows& places, const UsedSamples& samples, const SurfaceFrame& frame) {
  const std::size_t count = samples.size(), terms = places[0].size() + 1;
  const double floor = kFloor * std::max(frame.spread, frame.least_sigma);
  guess.inverse.assign(count + terms, std::vector<double>(count + terms, 0.0));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) guess.inverse[i][j] = Covariance(guess, places[i], places[j]);
    guess.inverse[i][i] += samples[i]->sigma * samples[i]->sigma + guess.scatter + floor * floor;
    for (std::size_t j = 0; j < terms; ++j) {
      guess.inverse[i][count + j] = guess.inverse[count + j][i] = j == 0 ? 1.0 : places[i][j - 1];
    }
  }
  const auto determinant = Invert(guess.inverse);
  if (!determinant) return false;
  guess.shares.assign(count + terms, 0.0);
  double squares = 0.0;
  for (std::size_t i = 0; i < count + terms; ++i) {
    for (std::size_t j = 0; j < count; ++j) guess.shares[i] += guess.inverse[i][j] * (samples[j]->focus - frame.middle);
    if (i < count) squares += guess.shares[i] * (samples[i]->focus - frame.middle);
  }
  const auto free = static_cast<double>(count) - static_cast<double>(terms);
  guess.weight = -0.5 * (squares + *determinant + free * std::log(2.0 * std::numbers::pi));
  for (const double size : {guess.bend, guess.scatter}) guess.weight += size == 0.0 ? std::log(kNoneToOne) : 0.0;
  return std::isfinite(guess.weight);
}

/// None, and sizes in equal ratios up to the spread of focus; as variances.
std::vector<double> SizesOf(const SurfaceFrame& frame) {
  const double most = std::max(0.5 * frame.spread, kMostSigmas * frame.least_sigma);
  const double least = std::max(kLeastSize * frame.least_sigma, kFloor * most);
  std::vector<double> sizes{0.0};
  for (int i = 0; i < kSizes; ++i) sizes.push_back(std::pow(least * std::pow(most / least, i / (kSizes - 1.0)), 2));
  return sizes;
}

bool Independent(const UsedSamples& samples, const SurfaceFrame& frame, bool squares) {
  Rows normal;
  for (const auto* sample : samples) {
    const auto place = ScaledPlace(frame, sample->at);
    std::vector<double> basis{1.0};
    basis.insert(basis.end(), place.begin(), place.end());
    for (std::size_t i = 0; squares && i < place.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) basis.push_back(place[i] * place[j]);
    }
    normal.resize(basis.size(), std::vector<double>(basis.size(), 0.0));
    for (std::size_t i = 0; i < basis.size(); ++i) {
      for (std::size_t j = 0; j < basis.size(); ++j) normal[i][j] += basis[i] * basis[j];
    }
  }
  const std::size_t count = normal.size();
  return InverseOf(std::move(normal), count, kSingularSurface).has_value();
}

}  // namespace

SurfaceFrame FrameOf(const UsedSamples& samples) {
  SurfaceFrame frame{.low = samples[0]->at, .high = samples[0]->at, .least_sigma = samples[0]->sigma};
  double least = samples[0]->focus, most = least;
  for (const auto* sample : samples) {
    for (std::size_t i = 0; i < sample->at.size(); ++i) {
      frame.low[i] = std::min(frame.low[i], sample->at[i]);
      frame.high[i] = std::max(frame.high[i], sample->at[i]);
    }
    least = std::min(least, sample->focus), most = std::max(most, sample->focus);
    frame.least_sigma = std::min(frame.least_sigma, sample->sigma);
  }
  frame.spread = most - least;
  frame.middle = 0.5 * (most + least);
  return frame;
}

std::vector<double> ScaledPlace(const SurfaceFrame& frame, const std::vector<double>& at) {
  std::vector<double> place;
  for (std::size_t i = 0; i < at.size(); ++i) {
    place.push_back((at[i] - frame.low[i]) / (0.5 * (frame.high[i] - frame.low[i])) - 1.0);
  }
  return place;
}

bool TellsCurvature(const UsedSamples& samples, const SurfaceFrame& frame) {
  return Independent(samples, frame, true);
}

std::optional<JudgedSurface> FitGuesses(const UsedSamples& samples, const SurfaceFrame& frame) {
  for (std::size_t i = 0; i < frame.low.size(); ++i) {
    if (!(frame.high[i] > frame.low[i])) return std::nullopt;
  }
  if (!Independent(samples, frame, false)) return std::nullopt;
  JudgedSurface judged;
  CoordinateSurface& surface = judged.surface;
  surface.low = frame.low, surface.high = frame.high, surface.middle = frame.middle;
  for (const auto* sample : samples) surface.places.push_back(ScaledPlace(frame, sample->at));
  const auto sizes = SizesOf(frame);
  double best = -HUGE_VAL;
  for (const double bowl : {sizes[0], sizes[3], sizes[5], 0.25 * sizes.back()}) {
    for (const double bend : sizes) {
      for (const double scatter : sizes) {
        SurfaceGuess guess{.bowl = bowl, .bend = bend, .scatter = scatter};
        if (!Judge(guess, surface.places, samples, frame)) continue;
        best = std::max(best, guess.weight);
        surface.guesses.push_back(std::move(guess));
      }
    }
  }
  double sum = 0.0, curved = 0.0, scatter = 0.0;
  for (SurfaceGuess& guess : surface.guesses) sum += guess.weight = std::exp(guess.weight - best);
  judged.evidence = best + std::log(sum / (4.0 * std::pow(kSizes + kNoneToOne, 2)));
  std::erase_if(surface.guesses, [sum](const SurfaceGuess& guess) { return guess.weight < kLeastWeight * sum; });
  sum = 0.0;
  for (const SurfaceGuess& guess : surface.guesses) sum += guess.weight;
  for (SurfaceGuess& guess : surface.guesses) {
    guess.weight /= sum;
    curved += guess.bowl > 0.0 || guess.bend > frame.least_sigma * frame.least_sigma ? guess.weight : 0.0;
    scatter += guess.weight * guess.scatter;
  }
  if (surface.guesses.empty()) return std::nullopt;
  surface.curved = curved > kCurved;
  surface.curvature_seen = TellsCurvature(samples, frame);
  surface.scatter = std::sqrt(scatter);
  return judged;
}

SurfaceFocus FocusOn(const CoordinateSurface& surface, const std::vector<double>& at) {
  const auto place = ScaledPlace({.low = surface.low, .high = surface.high}, at);
  const std::size_t count = surface.places.size();
  double mean = 0.0, squares = 0.0, reference = 0.0;
  bool first = true;
  for (const SurfaceGuess& guess : surface.guesses) {
    std::vector<double> along;
    for (std::size_t i = 0; i < count; ++i) along.push_back(Covariance(guess, place, surface.places[i]));
    along.push_back(1.0);
    along.insert(along.end(), place.begin(), place.end());
    double variance = Covariance(guess, place, place);
    for (std::size_t i = 0; i < along.size(); ++i) variance -= along[i] * Dot(guess.inverse[i], along);
    const double focus = Dot(along, guess.shares);
    if (std::exchange(first, false)) reference = focus;
    mean += guess.weight * (focus - reference);
    squares += guess.weight * (std::max(0.0, variance) + std::pow(focus - reference, 2));
  }
  return {surface.middle + reference + mean, std::sqrt(std::max(0.0, squares - mean * mean))};
}

}  // namespace lensd::autofocus
