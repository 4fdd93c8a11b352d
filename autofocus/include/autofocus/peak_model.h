// Which curve a sharpness peak follows, and where that curve has its top.
//
// Three shapes are in use: a parabola, a Gaussian and a hyperbola (sharpness as one over a parabola, as the size of a
// blurred detail is a hyperbola over position). They have the same three parameters, so none contains another; but all
// are members of one family,
//
//   y = A (1 - L u^2/2)^(1/L),  u = (x - m)/w:   L = 1 parabola, L -> 0 Gaussian, L = -1 hyperbola,
//
// (the power transform of Box and Cox, 1964, y^L being a parabola), in which each is nested by holding L fixed. So each
// is tested against the whole family: F = (S - S*)/(S*/(n - 4)), with S the weighted sum of squared residuals of the
// shape, S* the least one over all L and n the number of points. Were the shape true, F would follow the F distribution
// with 1 and n - 4 degrees of freedom (for small noise: the fits are not linear). A shape is rejected beyond the 95 %
// point; of those that remain the one with the least S is taken, and how far the tops of the others are from its own
// counts as error of the answer. Four points or fewer reject nothing.
#pragma once

#include <array>
#include <expected>
#include <span>
#include <string>
#include <string_view>

#include "autofocus/peak_fit.h"

namespace lensd::autofocus {

enum class PeakModel { Parabola, Gaussian, Hyperbola };
inline constexpr std::array kPeakModels = {PeakModel::Parabola, PeakModel::Gaussian, PeakModel::Hyperbola};
std::string_view PeakModelName(PeakModel model);

/// One shape fitted to the points.
struct ModelFit {
  double position = 0.0;   ///< of the top
  double sigma = 0.0;      ///< of `position`, from the points' own sigmas
  double height = 0.0;     ///< of the top
  double residual2 = 0.0;  ///< weighted sum of squared residuals
  double f = 0.0;          ///< against the family; 0 where it cannot be told
  bool rejected = false;   ///< at 5 %
  bool converged = false;  ///< to a top that curves downward
};

struct PeakChoice {
  PeakModel model = PeakModel::Gaussian;
  double position = 0.0;
  double sigma = 0.0;  ///< of `position`: noise, scatter beyond it, and the choice of the shape
  std::array<ModelFit, kPeakModels.size()> fits{};
  double f_limit = 0.0;  ///< the 95 % point; infinite with four points or fewer
};

/// Refused, with the reason in words for people: fewer than three points, a level line explains them as well (at
/// 10^-4), they do not curve downward, their scatter about the best shape is neither noise nor small beside the peak,
/// or the top is not among them.
std::expected<PeakChoice, std::string> ChoosePeak(std::span<const CurvePoint> points);

}  // namespace lensd::autofocus
