// Focus measures of frames: checks, sums (in integers), then one division to physical units.
#include "autofocus/measures.h"

#include <cmath>
#include <numbers>
#include <string>

namespace lensd::autofocus {
namespace {

Result<GreyView<std::uint16_t>> ViewOf(const drivers::Frame& frame, Window window) {
  const bool inside = window.x >= 0 && window.y >= 0 && window.width >= 3 && window.height >= 3 &&
                      window.width <= frame.width - window.x && window.height <= frame.height - window.y;
  if (!inside || !frame.samples) {
    return Fail(Code::InvalidArgument, "the focus window must be at least 3 x 3 px and inside the " +
                                           std::to_string(frame.width) + " x " + std::to_string(frame.height) +
                                           " frame");
  }
  const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(window.y) * frame.width + window.x;
  return GreyView<std::uint16_t>{frame.samples->data() + first, window.width, window.height, frame.width};
}

}  // namespace

Result<FocusScore> ScoreFocus(const drivers::Frame& frame, Window window) {
  auto view = ViewOf(frame, window);
  if (!view) return PassOn(view);
  const auto full = static_cast<double>((1u << frame.bits) - 1u);
  const FocusSums sums = SumFocus(*view, static_cast<std::uint16_t>(full));
  const double all = static_cast<double>(window.width) * window.height;
  FocusScore score;
  const double inner = static_cast<double>(window.width - 2) * (window.height - 2);
  score.gradient_energy = static_cast<double>(sums.gradient) / (64.0 * full * full * inner);
  // White noise gives the second difference a standard deviation of 6 (root of the mask's squared sum, 36), and a
  // normal variable's mean size is sqrt(2 / pi) of its standard deviation.
  score.noise = static_cast<double>(sums.noise) / (full * static_cast<double>(sums.noise_pixels)) *
                std::sqrt(0.5 * std::numbers::pi) / 6.0;
  score.saturated_fraction = static_cast<double>(sums.saturated) / all;
  score.mean = static_cast<double>(sums.light) / (full * all);
  return score;
}

}  // namespace lensd::autofocus
