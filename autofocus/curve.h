// What every method that samples the sharpness curve has to judge in the same way: is there a peak, where is it, and
// may it be believed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autofocus/method.h"
#include "autofocus/peak_fit.h"

namespace lensd::autofocus {

/// A frame of the curve.
struct CurveSample {
  double position = 0.0;
  double position_sigma = 0.0;
  FocusScore score;
};

class SharpnessCurve {
 public:
  /// Of the frames that follow: significant bits of a sample, and pixels in the window.
  void SetFrame(const Look& look);
  void Add(const Look& look);
  std::size_t size() const { return samples_.size(); }
  /// All frames in order of position.
  std::vector<CurvePoint> Points() const;
  /// Whether clipping comes and goes with focus: then gradients are cut off just where they would be steepest.
  bool Overexposed() const;

 private:
  int bits_ = 8;
  int pixels_ = 1;
  std::vector<CurveSample> samples_;
};

/// The top of a curve that stands out of the noise.
struct CurveTop {
  std::size_t index = 0;
  double prominence = 0.0;  ///< of the top over the rest, in standard deviations
  double rest = 0.0;        ///< what the curve comes down to away from its top
};
/// Nothing: no peak that stands out. `points` in order of position, not empty.
std::optional<CurveTop> TopOf(const std::vector<CurvePoint>& points);

/// Why TopOf() finds nothing, for people.
inline constexpr const char* kNoPeak =
    "nothing in the region changes with focus: no texture, too much noise, or too little light";

Verdict Refuse(std::string reason);

/// The verdict about the peak at `top`, from the points within `reach` of it. `step`: between neighbouring frames
/// there.
Verdict JudgePeak(const Setup& setup, const SharpnessCurve& curve, const std::vector<CurvePoint>& points,
                  const CurveTop& top, double reach, double step);

}  // namespace lensd::autofocus
