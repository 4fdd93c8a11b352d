// What all cameras have in common: a focus region that autofocus can work with.
#include "drivers/api/camera.h"

#include <algorithm>
#include <chrono>
#include <sstream>
#include <utility>

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

double Milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

Result<void> CheckExposure(const CameraCapabilities& can, Duration exposure) {
  const bool too_long = can.longest_exposure > Duration::zero() && exposure > can.longest_exposure;
  if (exposure > Duration::zero() && exposure >= can.shortest_exposure && !too_long) return {};
  ErrorFacts facts{.parameter = "exposureMs", .unit = "ms"};
  std::ostringstream message;
  message << "an exposure of " << Milliseconds(exposure) << " ms is outside what this camera takes:";
  if (can.shortest_exposure > Duration::zero()) {
    facts.minimum = Milliseconds(can.shortest_exposure);
    message << " from " << *facts.minimum << " ms";
  } else {
    message << " above 0 ms";
  }
  if (can.longest_exposure > Duration::zero()) {
    facts.maximum = Milliseconds(can.longest_exposure);
    message << " to " << *facts.maximum << " ms";
  }
  return Fail(Code::OutOfRange, message.str(), std::move(facts));
}

Result<void> CheckGain(const std::optional<GainRange>& range, double gain) {
  if (!range) return Fail(Code::Unsupported, "this camera's gain cannot be set");
  if (gain >= range->lowest && gain <= range->highest) return {};
  const bool decibels = range->unit == GainUnit::Decibels;
  std::ostringstream message;
  message << "gain " << gain << " is outside " << range->lowest << ".." << range->highest
          << (decibels ? " dB" : " (the camera's own count)");
  return Fail(
      Code::OutOfRange, message.str(),
      {.parameter = "gain", .minimum = range->lowest, .maximum = range->highest, .unit = decibels ? "dB" : "native"});
}

}  // namespace

Camera::Camera(CameraCapabilities capabilities) : capabilities_(std::move(capabilities)) {
  Region& region = capabilities_.focus_region;
  Grow(region.x, region.width, capabilities_.width);
  Grow(region.y, region.height, capabilities_.height);
}

Result<void> Camera::Check(const ExposureState& wanted) const {
  if (wanted.exposure) {
    if (auto good = CheckExposure(capabilities_, *wanted.exposure); !good) return good;
  }
  return wanted.gain ? CheckGain(capabilities_.gain, *wanted.gain) : Result<void>();
}

Result<void> Camera::SetExposure(Duration exposure) {
  if (auto good = CheckExposure(capabilities_, exposure); !good) return good;
  return Noted(DoSetExposure(exposure));
}

Result<void> Camera::SetGain(double gain) {
  if (auto good = CheckGain(capabilities_.gain, gain); !good) return good;
  return Noted(DoSetGain(gain));
}

}  // namespace lensd::drivers
