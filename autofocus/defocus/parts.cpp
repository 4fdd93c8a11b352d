#include "defocus/parts.h"

#include <algorithm>
#include <cmath>

#include "defocus/likelihood.h"

namespace lensd::autofocus::defocus {
namespace {

constexpr double kStep = 1.0;  // px of blur
constexpr double kHalfDepthOfFieldPx = 2.0;
constexpr std::size_t kLeastRings = 4;
constexpr double kClearly = 9.0;  // of log likelihood

}  // namespace

PartFocus FocusOfPart(const std::vector<PartFrame>& frames, Window part, double asked_about, double slope,
                      double lowest, double highest) {
  const Window window = AnalysisWindow(part, frames[0].frame->width, frames[0].frame->height, 36, 256);
  std::vector<Spectrum> spectra;
  std::vector<const Spectrum*> pointers;
  std::vector<double> positions;
  for (const PartFrame& frame : frames) {
    spectra.push_back(SpectrumOf(*frame.frame, window));
    if (frame.shift.clear) Move(spectra.back(), frame.shift);
    positions.push_back(frame.at);
  }
  for (const Spectrum& spectrum : spectra) pointers.push_back(&spectrum);
  const RingStack stack = StackRings(pointers);
  if (stack.rings.size() < kLeastRings) return {};
  const Likelihood likelihood(stack, positions);
  const auto judge = [&](double at) {
    const Fit fit = likelihood.At(at, slope);
    return fit.log_likelihood + fit.log_prior;
  };
  PartFocus found{.textured = true, .focus = asked_about};
  double near = judge(asked_about);
  double best = near;
  for (double at = lowest; at <= highest; at += kStep) {
    const double here = judge(at);
    if (std::abs(at - asked_about) <= kHalfDepthOfFieldPx) near = std::max(near, here);
    if (here <= best) continue;
    best = here;
    found.focus = at;
  }
  found.elsewhere = best - near >= kClearly;
  return found;
}

}  // namespace lensd::autofocus::defocus
