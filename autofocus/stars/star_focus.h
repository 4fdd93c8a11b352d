// Focus by points of light, whose half-flux radius grows evenly on either side of their focus.
//
// From the first frame's radius it goes about as far as that needs, to one side or the other, until the stars are
// small; where none can be seen it looks over the whole range first. Around the smallest it takes a curve of frames
// two and a half px of blur apart, fits every star's own hyperbola and answers where they agree, having seen the stars
// larger on both sides and small again in a last frame. Stars that are too bright count as well: a disk of full scale
// is least at the same place.
#pragma once

#include <deque>
#include <optional>
#include <string_view>
#include <vector>

#include "autofocus/method.h"
#include "autofocus/search/sharpness_curve.h"
#include "autofocus/stars/star_curve.h"

namespace lensd::autofocus {

class StarFocus final : public Method {
 public:
  explicit StarFocus(const Setup& setup);
  Advice Next(const Look& look) override;
  int FramesExpected() const override;

 private:
  enum class Stage { Approach, Coarse, Curve, Check };

  Advice Ask();
  Advice Approach();
  std::optional<double> OtherPlace(const StarLook& best, double away) const;
  Advice StartCoarse();
  Advice AfterCoarse();
  Advice StartCurve(double centre);
  Advice AfterCurve();
  Advice GiveUp(Why why);
  Advice Extend(std::vector<double> places);
  std::vector<double> Unseen(const StarFocusPlace& agreed, double sign) const;
  std::vector<StarLook> InOrder() const;
  Verdict Answer(const StarLook& last) const;

  Setup setup_;
  double px_ = 0.0;  ///< change of position for a pixel of blur; 0: not known yet
  Stage stage_ = Stage::Approach;
  std::vector<StarLook> looks_;  ///< of this stage
  std::deque<double> to_visit_;
  StarFocusPlace agreed_;  ///< once it is to be checked
  int frames_ = 0;
  int extended_ = 0;
  bool searched_ = false;  ///< the whole range
};

}  // namespace lensd::autofocus
