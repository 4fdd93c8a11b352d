// The truth of a world, its faults and its pictures for programs under test: from the world's own state alone.
#include "sim/bench.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "sim/render.h"

namespace lensd::sim {
namespace {

using drivers::Axis;

constexpr double kMostSteps = 1e8;
constexpr double kMostFactor = 1e3;
constexpr double kMostDegrees = 1e3;

std::unexpected<Error> Wrong(const char* parameter, std::string why) {
  return Fail(Code::InvalidArgument, std::move(why), {.parameter = parameter});
}

/// A fault as asked for, checked as a scene file's.
Result<Fault> FaultOf(const drivers::SimulatedFault& wanted) {
  const auto kind = FaultKindFromName(wanted.kind);
  if (!kind) {
    return Wrong("kind", "there is no fault \"" + wanted.kind + "\": kinds are " + FaultKindNames());
  }
  if (wanted.steps && *kind != FaultKind::Jump) return Wrong("steps", "only a jump goes a number of steps");
  if (wanted.factor && *kind != FaultKind::WrongExposure && *kind != FaultKind::MissedSteps) {
    return Wrong("factor", "only wrong-exposure and missed-steps have a factor");
  }
  if (wanted.by_c && *kind != FaultKind::Warmth && *kind != FaultKind::WrongTemperature) {
    return Wrong("byC", "only warmth and wrong-temperature go by degrees");
  }
  Fault fault;
  fault.kind = *kind;
  fault.axis = wanted.axis.value_or(Axis::Focus);
  if (wanted.lasts) fault.for_ms = std::chrono::duration<double, std::milli>(*wanted.lasts).count();
  fault.steps = wanted.steps.value_or(fault.steps);
  fault.factor = wanted.factor.value_or(fault.factor);
  fault.by_c = wanted.by_c.value_or(fault.by_c);
  if (!(std::abs(fault.by_c) <= kMostDegrees)) return Wrong("byC", "byC is from -1000 to 1000");
  if (!(std::abs(fault.steps) <= kMostSteps)) return Wrong("steps", "steps is from -1e8 to 1e8");
  if (!(fault.factor >= 0.0 && fault.factor <= kMostFactor)) return Wrong("factor", "factor is from 0 to 1000");
  if (fault.kind == FaultKind::MissedSteps && fault.factor > 1.0) {
    return Wrong("factor", "factor is the part of each move that is lost: from 0 to 1");
  }
  return fault;
}

/// As the interface tells instants.
double Nanoseconds(Instant instant) {
  return static_cast<double>(instant.time_since_epoch().count());
}

}  // namespace

Bench::Bench(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures,
             std::shared_ptr<const std::atomic<Duration>> exposure)
    : mechanics_(std::move(mechanics)),
      exposure_(std::move(exposure)),
      pictures_(std::move(pictures)),
      maker_(mechanics_, pictures_, Sensor::Ideal, 0) {}

Result<drivers::SimulatedTruth> Bench::TruthAt(std::optional<Instant> at, std::optional<double> vergence_d) {
  const Instant first = mechanics_->InstantOf(mechanics_->Earliest()), last = mechanics_->InstantOf(mechanics_->Now());
  const Instant asked = at.value_or(last);
  if (asked < first || asked > last) {
    return Fail(Code::OutOfRange,
                asked > last ? "what will be is not known: atNs is to come"
                             : "what was then is not known any more, or the simulated lens was not open yet",
                {.parameter = "atNs", .minimum = Nanoseconds(first), .maximum = Nanoseconds(last), .unit = "ns"});
  }
  const TrueState state = mechanics_->StateAt(asked - mechanics_->InstantOf({}));
  drivers::SimulatedTruth truth;
  truth.at = asked;
  truth.positions[Axis::Focus] = Native{state.focus_steps};
  if (state.iris_steps) truth.positions[Axis::Iris] = Native{*state.iris_steps};
  if (state.zoom_mm) truth.positions[Axis::Zoom] = Native{*state.zoom_mm};
  if (state.filter) truth.positions[Axis::Filter] = Native{*state.filter};
  truth.extension_m = state.extension_m;
  truth.f_number = state.f_number;
  truth.focal_length_m = state.optics.focal_length_m;
  truth.focal_plane_d = state.focal_plane_d;
  const CameraSettings& camera = mechanics_->scene().camera;
  truth.pictures_bytes = pictures_->bytes();
  if (vergence_d) truth.blur_m = 1e-6 * camera.pixel_um * SignedBlurPx(camera, state.optics, *vergence_d);
  return truth;
}

Result<void> Bench::Inject(const drivers::SimulatedFault& wanted) {
  const auto fault = FaultOf(wanted);
  if (!fault) return PassOn(fault);
  if (IsOfOneAxis(fault->kind) && !mechanics_->capabilities().axes[fault->axis]) {
    return Fail(Code::Unsupported, "the simulated lens has no " + std::string(drivers::AxisName(fault->axis)) + " axis",
                {.axis = std::string(drivers::AxisName(fault->axis)), .parameter = "axis"});
  }
  mechanics_->Inject(*fault);
  return {};
}

Result<drivers::Frame> Bench::Render(const std::stop_token& stop) {
  const Scene& scene = mechanics_->scene();
  if (!scene.frames.empty()) {
    return Fail(Code::Unsupported, "this camera plays prepared frames: there is nothing to render");
  }
  const Duration length = exposure_->load();
  const Duration start = mechanics_->Now() - length;
  auto samples = maker_.Make(maker_.ShotOf({start, length, 0}), stop);
  if (!samples) return PassOn(samples);
  drivers::Frame frame;
  frame.width = scene.camera.width;
  frame.height = scene.camera.height;
  frame.bits = scene.camera.bits;
  frame.gamma = scene.camera.gamma;
  frame.samples = std::move(samples->luminance);
  if (samples->colour) frame.colour = [colour = std::move(samples->colour)] { return colour; };
  frame.exposure_start = mechanics_->InstantOf(start);
  frame.exposure_end = mechanics_->InstantOf(start + length);
  return frame;
}

}  // namespace lensd::sim
