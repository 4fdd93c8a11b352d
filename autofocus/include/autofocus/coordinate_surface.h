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

/// A plane, or one with a bowl on it that is curved alike in every coordinate after each is scaled to its range.
struct CoordinateSurface {
  std::vector<double> low{}, high{};  ///< of the samples that were used
  std::vector<double> terms{};        ///< 1, each coordinate from -1 to 1 over its range, and the sum of their squares
  std::vector<std::vector<double>> covariance{};
  bool curved = false;
  double scatter = 0.0;  ///< of samples about the surface, beyond their own sigmas

  /// OutOfRange: a coordinate lies outside the samples.
  Result<SurfaceFocus> At(const std::vector<double>& at) const;
};

/// Curved where at least three samples more than it has terms say so, at three sigmas. InvalidArgument: samples that
/// are no samples; OutOfRange: too few of them, or in too few places.
Result<CoordinateSurface> FitCoordinateSurface(std::vector<SurfaceSample>& samples);

}  // namespace lensd::autofocus
