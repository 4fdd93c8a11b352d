// A surface through samples that are all believed.
#pragma once

#include <optional>
#include <vector>

#include "autofocus/coordinate_surface.h"

namespace lensd::autofocus {

using UsedSamples = std::vector<const SurfaceSample*>;

constexpr double kSingularSurface = 1e-9;  ///< a pivot of normal equations beside the first

/// What surfaces must share for the samples to judge between them.
struct SurfaceFrame {
  std::vector<double> low{}, high{};
  double spread = 0.0;       ///< of focus
  double middle = 0.0;       ///< of the least and most of it
  double least_sigma = 0.0;  ///< of a sample
};

struct JudgedSurface {
  CoordinateSurface surface{};
  double evidence = 0.0;  ///< logarithm of how likely the samples are by it
};

SurfaceFrame FrameOf(const UsedSamples& samples);
/// From -1 to 1 over the range.
std::vector<double> ScaledPlace(const SurfaceFrame& frame, const std::vector<double>& at);
/// Nothing: the samples do not tell a slope along every coordinate.
std::optional<JudgedSurface> FitGuesses(const UsedSamples& samples, const SurfaceFrame& frame);
/// Without asking whether it lies between the samples.
SurfaceFocus FocusOn(const CoordinateSurface& surface, const std::vector<double>& at);
/// The rank of the samples' places in a plane, or in all squares and products of coordinates too, is full.
bool TellsCurvature(const UsedSamples& samples, const SurfaceFrame& frame);

}  // namespace lensd::autofocus
