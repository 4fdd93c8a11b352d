// GetExposure and SetExposure.
#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

/// What the camera says, and what it can.
struct ExposureNow {
  drivers::ExposureState state;
  drivers::CameraCapabilities can;
};

Json InMilliseconds(std::optional<Duration> duration) {
  return duration ? Json(std::chrono::duration<double, std::milli>(*duration).count()) : Json(nullptr);
}

Json ExposureJson(const std::string& lens, const ExposureNow& now) {
  const auto known = [](Duration duration) {
    return duration > Duration::zero() ? InMilliseconds(duration) : Json(nullptr);
  };
  const auto& gain = now.can.gain;
  return {{"lens", lens},
          {"exposureMs", InMilliseconds(now.state.exposure)},
          {"canSetExposure", now.can.can_set_exposure},
          {"exposureMinMs", known(now.can.shortest_exposure)},
          {"exposureMaxMs", known(now.can.longest_exposure)},
          {"exposureStepMs", known(now.can.exposure_step)},
          {"gain", now.state.gain ? varlink::NumberOrNull(*now.state.gain) : Json(nullptr)},
          {"canSetGain", gain.has_value()},
          {"gainMin", gain ? varlink::NumberOrNull(gain->lowest) : Json(nullptr)},
          {"gainMax", gain ? varlink::NumberOrNull(gain->highest) : Json(nullptr)},
          {"gainStep", gain && gain->step > 0.0 ? Json(gain->step) : Json(nullptr)},
          {"gainUnit", gain ? Json(gain->unit == drivers::GainUnit::Decibels ? "dB" : "native") : Json(nullptr)}};
}

void Expose(ServedLens& lens, const ExchangePointer& exchange, const drivers::ExposureState& wanted) {
  const auto expose = [wanted](rig::Rig& rig, auto done) {
    auto state = rig.SetExposure(wanted);
    if (!state) return done(PassOn(state));
    done(ExposureNow{*state, *rig.camera()});
  };
  lens.Ask<ExposureNow>(expose, [&lens, exchange](const Result<ExposureNow>& now) {
    if (!now) return Refuse(exchange, lens, now.error());
    exchange->Finish(Wrap("exposure", varlink::WriteJson(ExposureJson(lens.name(), *now))));
  });
}

void GetExposure(ServedLens& lens, const ExchangePointer& exchange) {
  Expose(lens, exchange, {});
}

void SetExposure(ServedLens& lens, const ExchangePointer& exchange) {
  drivers::ExposureState wanted;
  if (const Json* ms = Given(exchange->parameters(), "exposureMs")) {
    // What no camera takes is left to the camera to refuse, which knows its range.
    constexpr double kBeyondMs = 1e12;
    wanted.exposure = Duration(std::llround(std::clamp(ms->get<double>(), -kBeyondMs, kBeyondMs) * 1e6));
  }
  if (const Json* gain = Given(exchange->parameters(), "gain")) wanted.gain = gain->get<double>();
  if (!wanted.exposure && !wanted.gain) {
    return Refuse(exchange, {Code::InvalidArgument, "say exposureMs, gain or both"});
  }
  Expose(lens, exchange, wanted);
}

}  // namespace

MethodTable ExposureMethods(LensService& service) {
  return {{"GetExposure", service.ForLens(GetExposure)}, {"SetExposure", service.ForLens(SetExposure)}};
}

}  // namespace lensd::daemon
