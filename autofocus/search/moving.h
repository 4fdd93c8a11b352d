// Focus while moving: one pass over the whole range without a stop, frames taken on the way.
//
// The lens goes to the far end of its backlash, then crosses the range no faster than kStridePx of blur from frame to
// frame (the exposure is a part of that), and each frame counts at the place where the lens was in the middle of its
// exposure, with the error of that place. The picture of a moving lens is its blur averaged over the exposure, which
// flattens the peak evenly on both sides and leaves its place. The top is that of the curve which fits best
// (peak_model.h); then one approach from the side of the sweep, and a frame there, standing, that has to be as sharp as
// the sweep promised. Where frames came more rarely than the camera said, or readings of the place too far apart,
// another, slower pass around the top follows. Needs a lens that tells its place in motion, at a known speed.
#pragma once

#include "autofocus/method.h"
#include "autofocus/search/sharpness_curve.h"

namespace lensd::autofocus {

class Moving final : public Method {
 public:
  /// `setup.stride` must be there.
  explicit Moving(const Setup& setup);
  Advice Next(const Look& look) override;
  int FramesExpected() const override;

 private:
  Advice Conclude();

  Setup setup_;
  double from_, to_;     ///< of the pass
  double stride_ = 0.0;  ///< wanted between frames
  double pace_ = 0.0;    ///< asked for, to that end
  int passes_ = 1;
  bool started_ = false;
  bool at_start_ = false;
  SharpnessCurve curve_;
};

}  // namespace lensd::autofocus
