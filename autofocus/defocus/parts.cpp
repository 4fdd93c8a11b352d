#include "defocus/parts.h"

#include <algorithm>

#include "defocus/likelihood.h"

namespace lensd::autofocus::defocus {
namespace {

constexpr double kReach = 40.0;  // px of blur around the focus where a part may have its own
constexpr double kStep = 1.0;
constexpr std::size_t kLeastRings = 4;
constexpr double kClearly = 9.0;  // of log likelihood

}  // namespace

bool PartAgrees(const std::vector<PartFrame>& frames, Window part, double focus, double slope) {
  const Window window = AnalysisWindow(part, frames[0].frame->width, frames[0].frame->height, 36, 256);
  std::vector<Spectrum> spectra;
  std::vector<const Spectrum*> pointers;
  std::vector<double> positions;
  for (const PartFrame& frame : frames) {
    spectra.push_back(SpectrumOf(*frame.frame, window));
    positions.push_back(frame.at);
  }
  for (const Spectrum& spectrum : spectra) pointers.push_back(&spectrum);
  const RingStack stack = StackRings(pointers);
  if (stack.rings.size() < kLeastRings) return true;
  const Likelihood likelihood(stack, positions);
  const auto judge = [&](double at) {
    const Fit fit = likelihood.At(at, slope);
    return fit.log_likelihood + fit.log_prior;
  };
  double near = judge(focus);
  double far = near;
  for (double off = kStep; off <= kReach; off += kStep) {
    const double here = std::max(judge(focus + off), judge(focus - off));
    double& best = off <= 2.0 ? near : far;
    best = std::max(best, here);
  }
  return far - near < kClearly;
}

}  // namespace lensd::autofocus::defocus
