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
#include "defocus/posterior.h"
#include "defocus/spectrum.h"

namespace lensd::autofocus {

class Defocus final : public Method {
 public:
  explicit Defocus(const Setup& setup) : setup_(setup) {}
  Advice Next(const Look& look) override;
  int FramesExpected() const override;

 private:
  struct Taken {
    double at = 0.0;  ///< position in pixels of blur
    drivers::Frame frame;
    defocus::Spectrum spectrum;
  };
  std::vector<const Taken*> Nearest(double focus) const;
  defocus::Posterior PosteriorOf(const defocus::RingStack& stack, const std::vector<const Taken*>& frames) const;
  std::optional<std::string> Unusable() const;
  Advice GoTo(double at);
  double SecondPlace(const defocus::Posterior& posterior) const;
  double NextPlace(double focus) const;
  const Taken* FrameInFocus(const defocus::Posterior& posterior) const;
  bool PartsAgree(const std::vector<const Taken*>& frames, const defocus::Posterior& posterior, double at) const;
  Verdict Accept(const Taken& frame, const defocus::Posterior& posterior) const;
  bool Beyond(const defocus::Posterior& posterior) const;
  std::string WhyNot(const defocus::RingStack& stack, const defocus::Posterior& posterior) const;

  Setup setup_;
  Window asked_;     ///< where the subject is
  Window analysed_;  ///< what is transformed: at least as large
  std::vector<Taken> taken_;
  double focus_ = 0.0;  ///< the newest estimate, pixels of blur
};

}  // namespace lensd::autofocus
