// Best focus as a surface over coordinates that are not the lens's own: x and y of a stage, the angle of a slide.
#pragma once

#include <vector>

#include "base/result.h"

namespace lensd::autofocus {

/// One place where focus was found. Every sample of a surface has as many coordinates.
struct SurfaceSample {
  std::vector<double> at{};
  double focus = 0.0;
  double sigma = 0.0;    ///< of focus, above zero
  double off = 0.0;      ///< from the surface; FitCoordinateSurface says it
  bool outlier = false;  ///< left out; FitCoordinateSurface says it
};

struct SurfaceFocus {
  double focus = 0.0;
  double sigma = 0.0;  ///< of the surface there
};

/// What is assumed of a surface beyond its plane, as variances of focus where every coordinate is at the end of its
/// range, and what the samples make of it.
struct SurfaceGuess {
  double bowl = 0.0;                           ///< curved alike along every coordinate
  double bend = 0.0;                           ///< curved in any way that is smooth
  double scatter = 0.0;                        ///< of each sample, beyond its own sigma
  double weight = 0.0;                         ///< how far the samples speak for it; all together make 1
  std::vector<std::vector<double>> inverse{};  ///< of the samples' covariance, bordered by the terms of the plane
  std::vector<double> shares{};                ///< that times the samples' focus from `middle`
};

/// A plane, a bowl on it and a smooth rest, as sure as the samples are.
struct CoordinateSurface {
  std::vector<double> low{}, high{};          ///< of the samples that were used
  std::vector<std::vector<double>> places{};  ///< theirs, from -1 to 1 over the range
  std::vector<SurfaceGuess> guesses{};
  double middle = 0.0;  ///< that `shares` count from
  bool curved = false;
  bool curvature_seen = false;  ///< in every direction: the samples have enough places for that
  double scatter = 0.0;         ///< of samples about the surface, beyond their own sigmas

  /// The place among the samples, or between them, that is nearest; `at` itself where it is between them.
  std::vector<double> Nearest(const std::vector<double>& at) const;
  /// OutOfRange: the place does not lie between the samples.
  Result<SurfaceFocus> At(const std::vector<double>& at) const;
};

/// InvalidArgument: samples that are no samples; OutOfRange: too few of them, or in too few places.
Result<CoordinateSurface> FitCoordinateSurface(std::vector<SurfaceSample>& samples);

}  // namespace lensd::autofocus
