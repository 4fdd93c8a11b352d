// The mean of the newest runs, and the spread in which the next one is expected: wider for few runs by Student's t, and
// never narrower than lenses are constant over field, aperture and texture.
#include "autofocus/slope_learner.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "autofocus/method.h"

namespace lensd::autofocus {
namespace {

constexpr double kLeastSigma = 0.05;  // of the logarithm
constexpr double kOdd = 3.0;          // sigmas
/// Student's 97.5 % quantile for so many runs less one, from two on.
constexpr double kQuantile[] = {12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262};

}  // namespace

void GoBy(const KnownSlope& known, Setup& setup) {
  *setup.blur_px *= std::exp(-known.log_factor);
  setup.slope_sigma = known.sigma;
  setup.learned_log_factor = known.log_factor;
}

bool IsOfAnotherLens(double log_over_known, double sigma) {
  return std::abs(log_over_known) > kOdd * sigma;
}

SlopeLearner::Learned SlopeLearner::Add(double log_factor) {
  const double shown = std::clamp(log_factor, -kMostLog, kMostLog);
  const auto known = Known();
  const bool another = known && IsOfAnotherLens(shown - known->log_factor, known->sigma);
  if (another) shown_.clear();
  shown_.push_back(shown);
  if (shown_.size() > kMost) shown_.erase(shown_.begin());
  return another ? Learned::AnotherLens : Learned::Added;
}

std::optional<KnownSlope> SlopeLearner::Known() const {
  if (shown_.size() < kFewest) return std::nullopt;
  const auto runs = static_cast<double>(shown_.size());
  const double mean = std::accumulate(shown_.begin(), shown_.end(), 0.0) / runs;
  double squares = 0.0;
  for (const double shown : shown_) squares += (shown - mean) * (shown - mean);
  const double next = std::sqrt(squares / (runs - 1.0) * (1.0 + 1.0 / runs));
  return KnownSlope{mean, std::max(next * kQuantile[shown_.size() - 2] / 1.96, kLeastSigma),
                    static_cast<int>(shown_.size())};
}

}  // namespace lensd::autofocus
