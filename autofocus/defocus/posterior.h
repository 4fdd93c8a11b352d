// Where the subject is in focus, as a density over positions.
//
// The likelihood is taken on a grid that is fine near the frames, where little blur tells much, and wide far from them;
// then finely around the best place. The slope of blur against position is not known exactly (focal length and aperture
// are nominal), so every place is judged under several slopes and the sum counts. Where even the best place explains
// the frames badly, all likelihoods are made as much weaker as it fits worse than chance allows.
#pragma once

#include <optional>
#include <vector>

#include "autofocus/defocus/likelihood.h"

namespace lensd::autofocus::defocus {

struct Range {
  double lowest = 0.0;
  double highest = 0.0;
};

class Posterior {
 public:
  /// Over `range`, in pixels of blur. `bend`: focused at x, the nominal slope is 1/(1 + bend x). `slope_sigma`:
  /// standard deviation of its logarithm where it was measured; 0: it was told.
  Posterior(const Likelihood& likelihood, Range range, double bend = 0.0, double slope_sigma = 0.0);

  /// Places focus(), sigma() and slope() between the grid's points.
  void Refine(const Likelihood& likelihood, Range range);

  double focus() const { return focus_; }  ///< mean of the highest peak
  double sigma() const { return sigma_; }  ///< standard deviation of it
  double slope() const { return slope_; }  ///< of blur against position: the most likely at the highest peak
  double relative_slope() const { return relative_slope_; }  ///< to the nominal one
  double misfit() const { return misfit_; }                  ///< Fit::excess at the best place
  /// Logarithm of the slope, relative to the nominal one, that explains the frames best with the focus at `focus`,
  /// whatever was believed of it before.
  double LogSlopeAt(const Likelihood& likelihood, double focus) const;
  /// Half the logarithm of the slope above the focus over that below, which explains the frames best with the focus and
  /// slope that go with it near those found; nothing: none within what lenses do.
  std::optional<double> UnevenOf(const Likelihood& likelihood) const;
  /// Probability that the focus is within `reach` of `position`.
  double MassNear(double position, double reach) const;
  /// Probability that it is below `position`.
  double MassBelow(double position) const;
  /// The peaks that hold at least the share `least` of the probability, in order of position.
  std::vector<double> Places(double least) const;
  /// Median distance of the focus from `position`.
  double TypicalDistance(double position) const;

  /// A top of the density over focus and slope.
  struct Peak {
    double focus = 0.0;
    double slope = 1.0;  ///< relative to the nominal one
    double sigma = 0.0;  ///< of the focus
    double height = 0.0;
    double excess = 0.0;  ///< Fit::excess, where TopNear() found it
  };
  /// The one that `likelihood`, of the same frames elsewhere, has near `from`: found without derivatives, so that
  /// nothing keeps it from an answer.
  Peak TopNear(const Likelihood& likelihood, const Peak& from) const;

 private:
  struct Cell {
    double focus = 0.0;
    double width = 0.0;
    double mass = 0.0;
  };
  double LogSlopePrior(double slope) const;
  void Evaluate(const Likelihood& likelihood, const std::vector<double>& places);
  std::vector<Cell> Cells() const;
  void Describe();
  double Judge(const Likelihood& likelihood, const Peak& peak) const;
  std::optional<Peak> Climb(const Likelihood& likelihood) const;

  struct Sample {
    double focus = 0.0;
    double slope = 0.0;
    double log_slope_prior = 0.0;
    Fit fit;
  };
  std::vector<Sample> samples_;
  double bend_ = 0.0;
  double known_well_ = 0.0;  ///< standard deviation of the logarithm of most slopes
  double weakening_ = 1.0;
  std::vector<Cell> cells_;
  double focus_ = 0.0;
  double sigma_ = 0.0;
  double relative_slope_ = 1.0;  ///< to the nominal one
  double slope_ = 1.0;
  double misfit_ = 0.0;
};

}  // namespace lensd::autofocus::defocus
