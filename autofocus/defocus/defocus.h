// Depth from defocus: the lens's own optics turn blur into distance, so that two frames say where the subject is in
// focus and a third proves it.
//
// The first frame, under a prior of what textures look like, tells how large its blur is but hardly on which side. The
// second is taken a good part of that blur away; between them the two blurs, by their different effect on each
// frequency, single out one focus position. The third is taken there. A frame is accepted as in focus if it stands
// where all frames together place the focus, nearly all probability lies within half a depth of field of it, the model
// explains what was seen, and no part of the window contradicts it. Until then each further frame goes to the best
// place known. It refuses, with the reason, rather than guess.
#pragma once

#include <optional>
#include <vector>

#include "autofocus/method.h"
#include "defocus/parts.h"
#include "defocus/posterior.h"
#include "defocus/shift.h"
#include "defocus/spectrum.h"

namespace lensd::autofocus {

class Defocus final : public Method {
 public:
  explicit Defocus(const Setup& setup) : setup_(setup) {}
  Advice Next(const Look& look) override;
  int FramesExpected() const override;
  Forecast Predict(const Look& first) const override;

 private:
  struct Taken {
    double position = 0.0;  ///< as it was told
    double at = 0.0;        ///< the same in pixels of blur
    bool loose = false;
    FocusScore score;
    drivers::Frame frame;
    defocus::Spectrum spectrum;
    defocus::Shift shift{};  ///< that would lay its picture on the first frame's
  };
  std::vector<const Taken*> Nearest(double focus) const;
  defocus::RingStack StackOf(const std::vector<const Taken*>& frames) const;
  defocus::Posterior PosteriorOf(const defocus::RingStack& stack, const std::vector<const Taken*>& frames) const;
  std::optional<std::string> Unusable() const;
  Advice GoTo(double at, bool loose = false);
  Advice GoToSecond(const defocus::Posterior& posterior);
  double NextPlace(double focus) const;
  const Taken* FrameInFocus(const defocus::Posterior& posterior) const;
  std::vector<defocus::PartFocus> Parts(const std::vector<const Taken*>& frames, double at, double slope,
                                        double reach) const;
  Verdict RefuseDepths() const;
  void Register();
  bool Changed(const Taken& one, const Taken& other) const;
  Verdict Accept(const Taken& frame, const defocus::Posterior& posterior) const;
  bool Beyond(const defocus::Posterior& posterior) const;
  Verdict WhyNot(const defocus::RingStack& stack, const defocus::Posterior& posterior) const;
  Verdict RefuseOpen(std::string reason, const defocus::Posterior& posterior) const;

  Setup setup_;
  Window asked_;     ///< where the subject is
  Window analysed_;  ///< what is transformed: at least as large
  std::vector<Taken> taken_;
  bool asked_loose_ = false;
  double focus_ = 0.0;       ///< the newest estimate, pixels of blur
  bool moving_ = false;      ///< between some frames the picture moved farther than can be undone
  bool unlike_ = false;      ///< two frames blurred nearly alike show nothing in common,
  bool doubtful_ = false;    ///< or two that are not,
  bool alike_ = false;       ///< while two that are do
  double moved_ = 0.0;       ///< px: the largest movement that can be
  bool registered_ = false;  ///< and it is
};

}  // namespace lensd::autofocus
