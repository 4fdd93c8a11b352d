// V4L2_CID_EXPOSURE_ABSOLUTE, and V4L2_CID_GAIN of cameras or V4L2_CID_ANALOGUE_GAIN of bare sensors. The kernel rounds
// and clamps without a word, so what was set is read back.
#include "image_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

namespace lensd::drivers::v4l2 {
namespace {

/// One exposure-time unit of V4L2.
constexpr Duration kExposureUnit = std::chrono::microseconds(100);

double Counts(Duration exposure) {
  return static_cast<double>(exposure.count()) / static_cast<double>(kExposureUnit.count());
}

/// The nearest value that the control takes: its steps count from its minimum.
std::int64_t OnGrid(const Control& control, double value) {
  const auto from = static_cast<double>(control.minimum);
  const std::int64_t steps = std::llround((value - from) / static_cast<double>(control.step));
  const std::int64_t most = (control.maximum - control.minimum) / control.step;
  return control.minimum + std::clamp<std::int64_t>(steps, 0, most) * control.step;
}

std::int64_t HighestOf(const Control& control) {
  return OnGrid(control, static_cast<double>(control.maximum));
}

}  // namespace

Result<std::optional<Control>> ImageControls::FirstOf(std::initializer_list<std::uint32_t> ids, const std::string& part,
                                                      drivers::Findings& findings) const {
  for (const std::uint32_t id : ids) {
    auto control = FindPart(*node_, id);
    if (control && *control && (*control)->readable) {
      if (const auto value = GetControlAtOpening(*node_, **control); !value) control = PassOn(value);
    }
    if (control && *control) {
      findings.TakeBack(part);
      return control;
    }
    if (control) continue;
    if (drivers::ConcernsAll(control.error())) return control;
    findings.LeaveOut(part, control.error());
  }
  return std::nullopt;
}

Result<ImageControls> ImageControls::Find(std::shared_ptr<const Node> node, std::shared_ptr<Automatics> automatics,
                                          drivers::Findings& findings) {
  ImageControls found(std::move(node), std::move(automatics));
  auto exposure = found.FirstOf({V4L2_CID_EXPOSURE_ABSOLUTE}, "exposure", findings);
  if (!exposure) return PassOn(exposure);
  found.exposure_control_ = *std::move(exposure);
  auto gain = found.FirstOf({V4L2_CID_GAIN, V4L2_CID_ANALOGUE_GAIN}, "gain", findings);
  if (!gain) return PassOn(gain);
  found.gain_control_ = *std::move(gain);
  return found;
}

void ImageControls::Describe(drivers::CameraCapabilities& can) const {
  can.can_set_exposure = exposure_control_.has_value();
  if (exposure_control_) {
    can.shortest_exposure = std::max<std::int64_t>(0, exposure_control_->minimum) * kExposureUnit;
    can.longest_exposure = HighestOf(*exposure_control_) * kExposureUnit;
    can.exposure_step = exposure_control_->step * kExposureUnit;
  }
  if (!gain_control_) return;
  can.gain = drivers::GainRange{.lowest = static_cast<double>(gain_control_->minimum),
                                .highest = static_cast<double>(HighestOf(*gain_control_)),
                                .unit = drivers::GainUnit::Native,
                                .step = static_cast<double>(gain_control_->step)};
}

Result<std::int64_t> ImageControls::Set(const Control& control, double value) {
  const std::int64_t wanted = OnGrid(control, value);
  if (auto set = SetControl(*node_, control, wanted); !set) return PassOn(set);
  if (!control.readable) return wanted;
  return GetControl(*node_, control);
}

Result<void> ImageControls::SetExposure(Duration exposure) {
  if (!exposure_control_) return Fail(Code::Unsupported, "this camera's exposure is fixed");
  if (auto held = automatics_->Hold(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL); !held) return held;
  const auto applied = Set(*exposure_control_, Counts(exposure));
  if (!applied) return PassOn(applied);
  exposure_ = *applied * kExposureUnit;
  const std::int64_t wanted = OnGrid(*exposure_control_, Counts(exposure));
  if (*applied == wanted) return {};
  std::ostringstream message;
  message << "the camera took an exposure of " << 0.1 * static_cast<double>(*applied) << " ms instead of "
          << 0.1 * static_cast<double>(wanted) << " ms";
  return Fail(Code::OutOfRange, message.str(), {.parameter = "exposureMs"});
}

Result<void> ImageControls::SetGain(double gain) {
  if (!gain_control_) return Fail(Code::Unsupported, "this camera's gain cannot be set");
  if (auto held = automatics_->Hold(V4L2_CID_AUTOGAIN, 0); !held) return held;
  const auto applied = Set(*gain_control_, gain);
  if (!applied) return PassOn(applied);
  const std::int64_t wanted = OnGrid(*gain_control_, gain);
  if (*applied == wanted) return {};
  return Fail(Code::OutOfRange,
              "the camera took a gain of " + std::to_string(*applied) + " instead of " + std::to_string(wanted),
              {.parameter = "gain"});
}

Result<std::optional<std::int64_t>> ImageControls::Ask(const std::optional<Control>& control) const {
  if (!control || !control->readable) return std::nullopt;
  // Whether it has an effect changes with the automatisms.
  const auto now = FindControl(*node_, control->id);
  if (!now) return PassOn(now);
  if (!*now || ((*now)->inactive && !(*now)->live)) return std::nullopt;
  const auto value = GetControl(*node_, *control);
  if (!value) return PassOn(value);
  return *value;
}

Result<drivers::ExposureState> ImageControls::Read() const {
  drivers::ExposureState state;
  const auto exposure = Ask(exposure_control_);
  if (!exposure) return PassOn(exposure);
  if (*exposure && **exposure > 0) state.exposure = **exposure * kExposureUnit;
  const auto gain = Ask(gain_control_);
  if (!gain) return PassOn(gain);
  if (*gain) state.gain = static_cast<double>(**gain);
  // A control that cannot be read has what was written.
  if (exposure_control_ && !exposure_control_->readable) state.exposure = exposure_;
  return state;
}

}  // namespace lensd::drivers::v4l2
