// What all cameras have in common: a focus region that autofocus can work with.
#include "drivers/api/camera.h"

#include <algorithm>
#include <sstream>

namespace lensd::drivers {
namespace {

constexpr double kLeastPx =
    32.0;  ///< of a focus region, each way: with fewer there is little to tell sharp from blurred

/// The span of `size` parts from `from`, at least kLeastPx of `px` about the same middle, inside the frame.
void Grow(double& from, double& size, int px) {
  const double least = px > 0 ? std::min(kLeastPx / px, 1.0) : 0.0;
  if (size >= least) return;
  from = std::clamp(from + 0.5 * (size - least), 0.0, 1.0 - least);
  size = least;
}

}  // namespace

Camera::Camera(CameraCapabilities capabilities) : capabilities_(std::move(capabilities)) {
  Region& region = capabilities_.focus_region;
  Grow(region.x, region.width, capabilities_.width);
  Grow(region.y, region.height, capabilities_.height);
}

Result<void> Camera::SetGain(double gain) {
  const auto& range = capabilities_.gain;
  if (!range) return Fail(Code::Unsupported, "this camera's gain cannot be set");
  if (!(gain >= range->lowest && gain <= range->highest)) {
    std::ostringstream message;
    message << "gain " << gain << " is outside " << range->lowest << ".." << range->highest
            << (range->unit == GainUnit::Decibels ? " dB" : " (the camera's own count)");
    return Fail(Code::OutOfRange, message.str());
  }
  return Noted(DoSetGain(gain));
}

}  // namespace lensd::drivers
