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

#include "autofocus/defocus/posterior.h"
#include "autofocus/defocus/shift.h"
#include "autofocus/method.h"
#include "autofocus/search/sharpness_curve.h"

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
    bool backlash_open = false;
    FocusScore score;
    drivers::Frame frame;
    defocus::Tiles spectra;
    double seconds = 0.0;    ///< at mid-exposure
    bool followed = false;   ///< by then the subject was known to move in depth
    defocus::Shift shift{};  ///< that would lay its picture on the first frame's
  };
  static constexpr double kHalfDepthOfFieldPx = 2.0;
  static constexpr double kSamePlace = 0.3;   ///< px of blur
  static constexpr double kPartOfBlur = 0.6;  ///< of the first frame: how far away the second is taken
  static constexpr std::size_t kFramesWithoutTexture = 4;
  static constexpr std::size_t kFrameBudget = 12;
  static constexpr double kTrustedPx =
      3.0;  ///< px of blur: nearly all probability lies within so much of a trusted estimate
  bool may_move() const { return setup_.subject == Setup::Subject::MayMove; }
  void Take(const Look& look);
  double LeftOut() const;  ///< share of the window
  defocus::Tiles SpectraOf(const drivers::Frame& frame) const;
  std::vector<const Taken*> Nearest(double focus) const;
  defocus::RingStack StackOf(const std::vector<const Taken*>& frames) const;
  defocus::Posterior PosteriorOf(const defocus::RingStack& stack, const std::vector<const Taken*>& frames) const;
  enum class Backlash { TakenUp, Open };
  Advice GoTo(double at, Backlash backlash = Backlash::TakenUp);
  Advice GoToSecond(const defocus::Posterior& posterior);
  std::optional<Advice> GoBeyondLastFocus(const defocus::Posterior& posterior);
  double OpenBy(double below, double above) const;
  std::optional<double> OpenBetween(const std::vector<CurvePoint>& points, double focus) const;
  std::optional<Advice> BetweenFarFrames(const Look& look, const std::vector<CurvePoint>& points, double focus,
                                         const defocus::RingStack& stack, const defocus::Posterior& posterior);
  Advice Decide(const Look& look, const defocus::RingStack& stack, const defocus::Posterior& posterior);
  Advice Climb(const std::vector<CurvePoint>& points, std::size_t best, const defocus::RingStack& stack,
               const defocus::Posterior& posterior);
  std::optional<double> EndBeside(const defocus::Posterior& posterior) const;
  std::optional<Advice> JudgeEnd(double end, const Look& look, const defocus::RingStack& stack,
                                 const defocus::Posterior& posterior);
  std::pair<double, double> WidestGap(const std::vector<CurvePoint>& points) const;
  std::optional<double> VertexAt(const std::vector<CurvePoint>& points, const CurvePoint& best) const;
  std::optional<double> GapBeside(const std::vector<CurvePoint>& points, const CurvePoint& best) const;
  double ShownSlope(const defocus::RingStack& stack, const defocus::Posterior& posterior, double focus) const;
  std::optional<double> ShownUneven(const defocus::Posterior& posterior, const CurvePoint& centre) const;
  std::optional<double> SlopeNear(const CurvePoint& centre) const;
  std::optional<double> ToSeeAgain(const CurvePoint& centre) const;
  const CurvePoint* NearestTo(const std::vector<CurvePoint>& points, double position) const;
  Advice Judge(const CurvePoint& centre, double vertex, double apart, const defocus::RingStack& stack,
               const defocus::Posterior& posterior);
  bool MayBeASideTop(const CurvePoint& top, bool agrees, double slope) const;
  static Verdict RefuseForGood(const Why& why);
  static double MidExposure(const drivers::Frame& frame);
  bool MayDrift(const defocus::RingStack& stack, const std::vector<const Taken*>& frames,
                const defocus::Posterior& posterior) const;
  std::optional<double> SideToSeeAgain(const CurvePoint& centre) const;
  /// An even motion of the subject in depth; lengths in px of blur.
  struct Course {
    double speed = 0.0;   ///< a second
    double focus = 0.0;   ///< at the last frame
    double slope = 1.0;   ///< of blur, relative to the nominal one
    double misfit = 0.0;  ///< as Posterior::misfit()
    double gain = 0.0;    ///< log probability over standing still
    double off = 0.0;     ///< of focus, from that of a subject standing still
    double open = 0.0;    ///< by so much the focus may be elsewhere, nearly as well
  };
  static std::optional<Course> CourseOf(const defocus::RingStack& stack, const std::vector<const Taken*>& frames,
                                        const defocus::Posterior& posterior);
  Advice Follow(const Look& look);
  void Register();
  bool Restless() const;
  bool BestIsAtAnEnd() const;
  bool Beyond(const defocus::Posterior& posterior) const;
  Verdict WhyNot(const defocus::RingStack& stack, const defocus::Posterior& posterior) const;
  Verdict RefuseOpen(Why why, const defocus::Posterior& posterior) const;

  Setup setup_;
  Window window_;  ///< where the subject is
  std::vector<Window> tiles_;
  defocus::Mask mask_;  ///< of the window: too bright in some frame
  std::vector<Taken> taken_;
  SharpnessCurve curve_;
  bool asked_open_ = false;
  double focus_ = 0.0;       ///< the newest estimate, pixels of blur
  bool moving_ = false;      ///< between some frames the picture moved farther than can be undone
  bool unlike_ = false;      ///< two frames blurred nearly alike show nothing in common
  double moved_ = 0.0;       ///< px: the largest movement that can be
  bool registered_ = false;  ///< and it is
};

}  // namespace lensd::autofocus
