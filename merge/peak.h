// The place of the top of a curve of which three points are known.
#pragma once

#include <optional>

namespace lensd::merge {

/// Sharpness at three neighbouring frames, the middle one the sharpest. Ends of the stack lack a neighbour.
struct PeakSamples {
  double before = -1.0, at = 0.0, after = -1.0;  ///< < 0: there is no such frame
  double noise = 0.0;                            ///< of it what noise alone adds
  double place_before = 0.0, place = 0.0, place_after = 0.0;
};

struct Peak {
  double place = 0.0;
  double sigma = 0.0;
};

/// Sharpness near its top follows exp(-bend (place - top)^2); nothing where a neighbour lacks or the top is flat.
std::optional<double> BendOf(const PeakSamples& samples);

/// The top, given how strongly such curves of this stack are bent as a rule. Nothing: at an end of the stack, and so
/// far beyond it that no frame says how far.
std::optional<Peak> FitPeak(const PeakSamples& samples, double usual_bend);

}  // namespace lensd::merge
