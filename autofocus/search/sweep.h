// The dependable method: look everywhere, then more finely around the sharpest place.
//
// A first pass crosses the whole range in steps that the optics give: narrow enough that wherever the subject is, one
// of the frames is near enough for its texture to show. Then the two steps around the sharpest frame are divided in
// three, and again, until the step is about a pixel of blur; the top is that of the curve which fits the last few
// frames best (peak_model.h). Every pass runs in the same direction, so that backlash shifts nothing.
// It refuses when the curve has no peak that stands out of the noise, or when the peak is not inside the range.
#pragma once

#include <deque>
#include <vector>

#include "autofocus/method.h"
#include "autofocus/search/sharpness_curve.h"

namespace lensd::autofocus {

/// Into how many steps the first pass divides the range.
int FirstIntervals(const Setup& setup);
/// How many parts a pass with such steps has each of them divided in for the next; 1: the motor has no finer ones.
int DivisionOf(const Setup& setup, double step);
/// About where the passes end; 0: unknown, judged from the curve.
double LastStep(const Setup& setup);
/// A pass with such steps shows the top of the curve at `best`: no finer one is needed.
bool FineEnough(const Setup& setup, double step, const std::vector<CurvePoint>& curve, std::size_t best);
/// The frames within so many steps of the top show its shape.
inline constexpr double kFitSteps = 2.6;

class Sweep final : public Method {
 public:
  explicit Sweep(const Setup& setup);
  Advice Next(const Look& look) override;
  int FramesExpected() const override;

 private:
  Advice Ask();
  Advice Conclude();
  enum class Ends { Included, LeftOut };
  void PlanPass(double from, double to, int intervals, Ends ends);
  bool LooksBetween();

  Setup setup_;
  double step_ = 0.0;  ///< of the pass being made
  int intervals_ = 0;  ///< of the range by the frames so far; 0: a top was found
  bool started_ = false;
  SharpnessCurve curve_;
  std::deque<double> to_visit_;
};

}  // namespace lensd::autofocus
