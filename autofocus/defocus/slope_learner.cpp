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

struct Next {
  double mean = 0.0;
  double sigma = 0.0;  ///< of what the next run will show
};

/// At least two.
Next NextOf(const std::vector<double>& shown) {
  const auto runs = static_cast<double>(shown.size());
  const double mean = std::accumulate(shown.begin(), shown.end(), 0.0) / runs;
  double squares = 0.0;
  for (const double one : shown) squares += (one - mean) * (one - mean);
  return {mean, std::sqrt(squares / (runs - 1.0) * (1.0 + 1.0 / runs)) * kQuantile[shown.size() - 2] / 1.96};
}

}  // namespace

void GoBy(const KnownSlope& known, Setup& setup) {
  *setup.blur_px *= std::exp(-known.log_factor);
  setup.slope_sigma = known.sigma;
  setup.learned_log_factor = known.log_factor;
  setup.uneven = known.uneven;
  setup.last_focus = known.last_focus;
}

bool IsOfAnotherLens(double log_over_known, double sigma) {
  return std::abs(log_over_known) > kOdd * sigma;
}

SlopeLearner::Learned SlopeLearner::Add(Shown run) {
  run.log_slope = std::clamp(run.log_slope, -kMostLog, kMostLog);
  const auto known = Known();
  const bool another = known && IsOfAnotherLens(run.log_slope - known->log_factor, known->sigma);
  if (another) shown_.clear();
  shown_.push_back(run);
  if (shown_.size() > kMost) shown_.erase(shown_.begin());
  return another ? Learned::AnotherLens : Learned::Added;
}

std::optional<KnownSlope> SlopeLearner::Known() const {
  if (shown_.size() < kFewest) return std::nullopt;
  std::vector<double> slopes, uneven;
  for (const Shown& run : shown_) {
    slopes.push_back(run.log_slope);
    if (run.uneven) uneven.push_back(*run.uneven);
  }
  const Next slope = NextOf(slopes);
  KnownSlope known{slope.mean, std::max(slope.sigma, kLeastSigma), static_cast<int>(shown_.size())};
  if (uneven.size() >= kFewest) {
    const Next next = NextOf(uneven);
    known.uneven = std::hypot(next.mean, next.sigma);
  }
  return known;
}

}  // namespace lensd::autofocus
