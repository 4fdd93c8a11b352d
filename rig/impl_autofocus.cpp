// The part of a rig that runs autofocus: what the session is told about the lens, and what it may do with it.
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "impl.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

/// Of the focus range: taken up at every reversal of an autofocus run while the true backlash is not known.
constexpr double kAssumedBacklash = 0.1;

}  // namespace

std::optional<FNumber> Rig::Impl::CurrentFNumber() const {
  if (!optics) return std::nullopt;
  if (!optics->has_iris()) return optics->fixed_f_number();
  if (motions_[Axis::Iris] && targets_[Axis::Iris]) return optics->FNumberFromNative(*targets_[Axis::Iris]);
  if (!state_ || !state_->axes[Axis::Iris]) return std::nullopt;
  return optics->FNumberFromNative(state_->axes[Axis::Iris]->position);
}

AutofocusRun::Scale Rig::Impl::ScaleOfRun() {
  const double resolution = setups_[Axis::Focus]->can.resolution;
  if (!optics || !optics->has_focus()) {
    return {.position = [](Native native) { return native.value; },
            .native = [](double position) { return Native{position}; },
            .resolution = resolution};
  }
  return {.position = [this](Native native) { return optics->ExtensionFromNative(native).value; },
          .native = [this](double position) { return optics->NativeFromExtension(Metres{position}); },
          .resolution = resolution,
          .optics = &*optics};
}

autofocus::Setup Rig::Impl::AutofocusSetup() {
  const AxisSetup& focus = *setups_[Axis::Focus];
  const AutofocusRun::Scale scale = ScaleOfRun();
  autofocus::Setup setup;
  std::tie(setup.lowest, setup.highest) = std::minmax({scale.position(focus.minimum), scale.position(focus.maximum)});
  setup.resolution = std::abs(scale.position(focus.minimum + Native{scale.resolution}) - scale.position(focus.minimum));
  const bool calibrated = scale.optics != nullptr;
  setup.ascending = calibrated ? focus.config.approach_near : focus.approach_up;
  const auto f_number = CurrentFNumber();
  const double pixel_m = device.camera->capabilities().pixel_um * 1e-6;
  // Blur changes by (1 - f U)/N of the extension's change: a little less than 1/N.
  if (calibrated && f_number && pixel_m > 0) setup.blur_px = f_number->value * pixel_m;
  return setup;
}

double Rig::Impl::AutofocusTakeUp() const {
  const AxisSetup& focus = *setups_[Axis::Focus];
  return focus.config.backlash.value_or(kAssumedBacklash * (focus.maximum - focus.minimum).value);
}

/// Answers of an earlier run never reach a later one.
AutofocusRun::Hands Rig::Impl::HandsOfRun() {
  const auto guarded = [this](auto callback) {
    return [this, run = run_number_, callback = std::move(callback)](auto answer) mutable {
      if (run_ && run == run_number_ && !run_ended_) callback(std::move(answer));
    };
  };
  AutofocusRun::Hands hands;
  hands.move = [this, guarded](Native target, MoveCallback done) {
    const AxisSetup& focus = *setups_[Axis::Focus];
    EndMotion(Axis::Focus, Fail(Code::Superseded, "autofocus went elsewhere"));
    StartMotion(Axis::Focus, std::clamp(target, focus.minimum, focus.maximum), AutofocusTakeUp(),
                guarded(std::move(done)));
  };
  hands.look = [this, guarded](SnapshotCallback done) {
    looks_.Add({.since = clock.Now(), .for_autofocus = true, .done = guarded(std::move(done))});
  };
  hands.now = [this] { return clock.Now(); };
  hands.motions = [this] { return run_motions_ + (motions_[Axis::Focus] ? motions_[Axis::Focus]->commands() : 0); };
  hands.end = [this](Result<AutofocusOutcome> outcome) {
    run_ended_ = true;
    looks_.ForgetAutofocus();
    Reply(std::exchange(autofocus_done_, nullptr), std::move(outcome));
  };
  return hands;
}

void Rig::Impl::Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done) {
  const auto refuse = [&](Error error) {
    Reply(std::move(done), Result<AutofocusOutcome>(std::unexpected(std::move(error))));
  };
  if (!device.camera) return refuse({Code::Unsupported, "autofocus needs a camera, and this lens has none"});
  if (!setups_[Axis::Focus]) return refuse({Code::Unsupported, "this lens has no motorised focus"});
  const auto& camera = device.camera->capabilities();
  const drivers::Region region = request.region.value_or(camera.focus_region);
  if (auto window = autofocus::WindowOf(region, camera.width, camera.height); !window) return refuse(window.error());
  if (request.deadline <= Duration::zero()) return refuse({Code::InvalidArgument, "a deadline must be above 0"});
  auto session = autofocus::Session::Create(request.method, AutofocusSetup());
  if (!session) return refuse(session.error());

  const bool focus_under_way = motions_[Axis::Focus] != nullptr;
  Disturb(Axis::Focus);
  if (focus_under_way && setups_[Axis::Focus]->can.can_stop) (void)device.lens->Stop(Axis::Focus);
  ++run_number_;
  run_motions_ = 0;
  autofocus_done_ = std::move(done);
  run_ = std::make_unique<AutofocusRun>(*std::move(session), region, clock.Now() + request.deadline, HandsOfRun(),
                                        ScaleOfRun(), std::move(progress));
  run_->Begin();
}

/// Ends the run from outside: superseded, stopped, or the lens is gone. Its motion of the focus axis ends unanswered.
void Rig::Impl::EndAutofocus(Result<AutofocusOutcome> end) {
  if (!run_ || run_ended_) return;
  run_.reset();
  motions_[Axis::Focus].reset();
  targets_[Axis::Focus].reset();
  looks_.ForgetAutofocus();
  Reply(std::exchange(autofocus_done_, nullptr), std::move(end));
}

}  // namespace lensd::rig
