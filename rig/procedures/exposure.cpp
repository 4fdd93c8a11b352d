// Exposure that follows the square of the working f-number while the iris moves, within what the camera allows.
#include "rig/exposure.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <utility>

#include "base/missing_optics.h"
#include "optics/light.h"
#include "rig/procedures/command_guard.h"

namespace lensd::rig {
namespace {

using drivers::Axis;
using Done = std::move_only_function<void(Result<BrightMove>)>;

constexpr double kUnchanged = 0.01;  ///< of brightness: too little to see

double Milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

FNumber Working(const OpticsTable& optics, FNumber f_number, Metres extension, double pupil_factor) {
  return optics::WorkingFNumber(f_number, extension / optics.FocalLengthAt(extension), pupil_factor);
}

std::string LimitText(const KeptExposure& kept) {
  if (std::abs(kept.ratio - 1.0) <= kUnchanged) return "";
  std::ostringstream text;
  text.precision(4);
  text << "the same brightness takes " << Milliseconds(kept.wanted) << " ms and the camera gives "
       << Milliseconds(kept.exposure) << " ms: " << std::abs(std::log2(kept.ratio)) << " stops "
       << (kept.ratio < 1.0 ? "darker" : "brighter");
  return text.str();
}

void SetExposure(Rig& rig, Duration before, FNumber working_before, double pupil_factor, MoveOutcome moved,
                 Done& done) {
  BrightMove bright{.move = std::move(moved), .exposure = {}, .reason = {}};
  const Status status = rig.GetStatus();
  if (!bright.move.f_number || !status.optics || !bright.move.reached) {
    bright.reason = "the exposure is as it was: the iris did not get where it was sent";
    return done(std::move(bright));
  }
  const Metres extension = status.extension.value_or(Metres{status.optics->nominal().min_extension_m});
  const FNumber working = Working(*status.optics, *bright.move.f_number, extension, pupil_factor);
  const KeptExposure kept = ExposureFor(before, working_before, working, *rig.camera());
  if (auto set = rig.SetExposure({.exposure = kept.exposure, .gain = {}}); !set) {
    bright.reason = "the exposure is as it was: " + set.error().message;
    return done(std::move(bright));
  }
  bright.exposure = kept;
  bright.reason = LimitText(kept);
  done(std::move(bright));
}

}  // namespace

KeptExposure ExposureFor(Duration before, FNumber working_before, FNumber working_after,
                         const drivers::CameraCapabilities& camera) {
  const double factor = (working_after / working_before) * (working_after / working_before);
  const double wanted = static_cast<double>(before.count()) * factor;
  double exposure = wanted;
  if (camera.longest_exposure > Duration::zero()) {
    exposure = std::min(exposure, static_cast<double>(camera.longest_exposure.count()));
  }
  if (camera.frame_rate_hz > 0.0) {
    exposure = std::min(exposure, std::max(1e9 / camera.frame_rate_hz, static_cast<double>(before.count())));
  }
  exposure = std::max(exposure, static_cast<double>(std::max(camera.shortest_exposure, Duration(1)).count()));
  constexpr double kMost = 9e18;
  return {.wanted = Duration(std::llround(std::min(wanted, kMost))),
          .exposure = Duration(std::llround(std::min(exposure, kMost))),
          .ratio = exposure / wanted};
}

void MoveIrisKeepingBrightness(Rig& rig, const Target& target, double pupil_factor, Done done) {
  const auto* camera = rig.camera();
  if (camera == nullptr || !camera->can_set_exposure) {
    return done(Fail(Code::Unsupported, camera == nullptr
                                            ? "brightness cannot be kept: this lens has no camera"
                                            : "brightness cannot be kept: this camera's exposure is fixed"));
  }
  if (rig.optics() == nullptr || !rig.optics()->has_iris()) {
    return done(Fail(Code::Unsupported, OpticsMissing("brightness cannot be kept: this lens' f-numbers are")));
  }
  if (auto lost = WhyLost(Axis::Iris, rig.GetStatus().axes[Axis::Iris])) return done(PassOn(*std::move(lost)));
  if (auto possible = rig.Resolve(Axis::Iris, target); !possible) return done(PassOn(possible));
  auto guard = std::make_shared<CommandGuard>(rig);
  guard->Snapshot([&rig, guard, target, pupil_factor, done = std::move(done)](Result<LensedFrame> seen) mutable {
    if (!seen) return done(PassOn(seen));
    const Duration before = seen->frame.exposure_end - seen->frame.exposure_start;
    const OpticsTable& optics = *rig.optics();
    if (!seen->f_number || before <= Duration::zero()) {
      return done(Fail(Code::Unsupported, "brightness cannot be kept: the camera does not report its exposure"));
    }
    const Metres extension = seen->extension.value_or(Metres{optics.nominal().min_extension_m});
    const FNumber working = Working(optics, *seen->f_number, extension, pupil_factor);
    guard->Move(Axis::Iris, target,
                [&rig, before, working, pupil_factor, done = std::move(done)](Result<MoveOutcome> moved) mutable {
                  if (!moved) return done(PassOn(moved));
                  SetExposure(rig, before, working, pupil_factor, *std::move(moved), done);
                });
  });
}

}  // namespace lensd::rig
