// From a focus and a slope to the blur of each frame, which the rings are judged by.
#include "autofocus/defocus/likelihood.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus::defocus {

Likelihood::Likelihood(const RingStack& stack, std::span<const double> positions) : rings_(stack) {
  std::ranges::copy(positions, positions_.begin());
}

Fit Likelihood::At(double focus, double slope, double uneven) const {
  std::array<double, kMostFrames> blur{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(rings_.frames()); ++i) {
    const double off = positions_[i] - focus;
    blur[i] = slope * off * (uneven == 0.0 ? 1.0 : std::exp(off > 0 ? uneven : -uneven));
  }
  return FitRings(rings_, blur);
}

}  // namespace lensd::autofocus::defocus
