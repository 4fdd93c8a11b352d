// The part of a rig that runs autofocus: what the session is told about the lens, and what it may do with it.
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "impl.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

}  // namespace

std::optional<FNumber> Rig::Impl::CurrentFNumber() const {
  if (!optics) return std::nullopt;
  if (!optics->has_iris()) return optics->fixed_f_number();
  if (motions_[Axis::Iris] && targets_[Axis::Iris]) return optics->FNumberFromNative(*targets_[Axis::Iris]);
  if (!state_ || !state_->axes[Axis::Iris]) return std::nullopt;
  return optics->FNumberFromNative(state_->axes[Axis::Iris]->position);
}

AutofocusRun::Scale Rig::Impl::ScaleOfRun() {
  const AxisSetup& focus = *setups_[Axis::Focus];
  AutofocusRun::Scale scale{.position = [](Native native) { return native.value; },
                            .native = [](double position) { return Native{position}; },
                            .resolution = focus.can.resolution};
  if (focus.backlash_known) scale.slack = focus.approach_up ? focus.backlash : -focus.backlash;
  // Depth from defocus knows lenses of one focal length: a liquid lens is searched in its own units.
  if (optics && optics->has_focus() && !optics->nominal().liquid) {
    scale.position = [this](Native native) { return optics->ExtensionFromNative(native).value; };
    scale.native = [this](double position) { return optics->NativeFromExtension(Metres{position}); };
    scale.optics = &*optics;
  }
  const double rate = device.camera ? device.camera->capabilities().frame_rate_hz : 0.0;
  if (focus.speed && rate > 0) {
    const double range = std::abs(scale.position(focus.maximum) - scale.position(focus.minimum));
    scale.stride = *focus.speed / rate * range / (focus.maximum - focus.minimum).value;
  }
  return scale;
}

autofocus::Setup Rig::Impl::AutofocusSetup(const AutofocusRequest& request) {
  const AxisSetup& focus = *setups_[Axis::Focus];
  const AutofocusRun::Scale scale = ScaleOfRun();
  autofocus::Setup setup;
  std::tie(setup.lowest, setup.highest) = std::minmax({scale.position(focus.minimum), scale.position(focus.maximum)});
  setup.resolution = std::abs(scale.position(focus.minimum + Native{scale.resolution}) - scale.position(focus.minimum));
  const double middle = 0.5 * (focus.minimum + focus.maximum).value;
  setup.backlash = std::abs(scale.position(Native{middle + scale.slack}) - scale.position(Native{middle}));
  const bool calibrated = scale.optics != nullptr;
  setup.near_is_high = calibrated || focus.config.near_positive;
  setup.ascending = calibrated ? focus.config.approach_near : focus.approach_up;
  const auto f_number = CurrentFNumber();
  const double pixel_m = (request.outside ? request.outside->pixel_um : device.camera->capabilities().pixel_um) * 1e-6;
  setup.pictures = !request.outside || !request.outside->scores_only;
  setup.no_stride = request.outside ? "frames from outside cannot be told the lens' place in motion" : WhyNotInMotion();
  if (setup.no_stride.empty()) setup.stride = scale.stride;
  if (calibrated && f_number && pixel_m > 0) {
    setup.blur_px = f_number->value * pixel_m;
    setup.focal_length = optics->FocalLengthAt(Metres{0.5 * (setup.lowest + setup.highest)}).value;
  }
  return setup;
}

/// Empty: frames of the moving focus axis can be told where it was.
std::string Rig::Impl::WhyNotInMotion() const {
  const AxisSetup& focus = *setups_[Axis::Focus];
  if (!focus.can.feedback) return "this lens does not say where it is while it moves";
  if (!focus.speed) return "the speed of this lens is not known; speed in its [lens.focus] says it";
  if (!(device.camera->capabilities().frame_rate_hz > 0)) return "this camera does not tell its frame rate";
  return "";
}

/// At a part of the full speed: a device without a choice of speeds goes in small even steps.
void Rig::Impl::Pass(Native target, double part_of_speed, MoveCallback done) {
  constexpr Duration kEach = std::chrono::milliseconds(4);
  const AxisSetup& focus = *setups_[Axis::Focus];
  const double way = std::abs((target - state_->axes[Axis::Focus]->position).value);
  const auto whole = std::chrono::duration<double>(way / (part_of_speed * *focus.speed));
  std::vector<Impulse> parts;
  if (part_of_speed < 1.0) parts = PacedParts(std::chrono::duration_cast<Duration>(whole), kEach);
  EndMotion(Axis::Focus, Fail(Code::Superseded, "autofocus went elsewhere"));
  StartMotion(Axis::Focus, std::clamp(target, focus.minimum, focus.maximum), 0.0, TakeUp::FromBeyond, std::move(done),
              std::move(parts));
}

/// Answers of an earlier run never reach a later one.
AutofocusRun::Hands Rig::Impl::HandsOfRun() {
  const auto guarded = [this](auto callback) {
    return [this, run = run_number_, callback = std::move(callback)](auto answer) mutable {
      if (run_ && run == run_number_ && !run_ended_) callback(std::move(answer));
    };
  };
  AutofocusRun::Hands hands;
  hands.move = [this, guarded](Native target, AutofocusRun::Arrival arrival, MoveCallback done) {
    const AxisSetup& focus = *setups_[Axis::Focus];
    EndMotion(Axis::Focus, Fail(Code::Superseded, "autofocus went elsewhere"));
    const double overshoot = arrival == AutofocusRun::Arrival::Anyhow ? 0.0 : focus.backlash;
    const TakeUp take_up = arrival == AutofocusRun::Arrival::Anew ? TakeUp::Always : TakeUp::FromBeyond;
    StartMotion(Axis::Focus, std::clamp(target, focus.minimum, focus.maximum), overshoot, take_up,
                guarded(std::move(done)));
  };
  hands.pass = [this, guarded](Native target, double part_of_speed, MoveCallback done) {
    Pass(target, part_of_speed, guarded(std::move(done)));
  };
  hands.look = [this, guarded](bool in_motion_too, SeenCallback done) {
    if (outside_) return outside_->Want(clock.Now(), guarded(std::move(done)));
    auto taken = [done = guarded(std::move(done))](Result<LensedFrame> frame) mutable {
      if (!frame) return done(Result<Seen>(std::unexpected(frame.error())));
      done(Result<Seen>(Seen{*std::move(frame), std::nullopt}));
    };
    looks_.Add({.since = clock.Now(), .for_autofocus = true, .in_motion_too = in_motion_too, .done = std::move(taken)});
  };
  hands.now = [this] { return clock.Now(); };
  hands.motions = [this] { return run_motions_ + (motions_[Axis::Focus] ? motions_[Axis::Focus]->commands() : 0); };
  hands.end = [this](Result<AutofocusOutcome> outcome) {
    run_ended_ = true;
    // A liquid lens is searched in its own units, and still focuses somewhere that is known.
    if (outcome && !outcome->vergence && optics && optics->has_focus()) {
      outcome->vergence = optics->VergenceFromExtension(optics->ExtensionFromNative(outcome->position));
    }
    looks_.ForgetAutofocus();
    Reply(std::exchange(autofocus_done_, nullptr), std::move(outcome));
  };
  return hands;
}

void Rig::Impl::Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done) {
  const auto refuse = [&](Error error) {
    Reply(std::move(done), Result<AutofocusOutcome>(std::unexpected(std::move(error))));
  };
  if (!device.camera && !request.outside) {
    return refuse(
        {Code::Unsupported, "this lens has no camera: autofocus needs one, or frames from outside (AutofocusBegin)"});
  }
  if (!setups_[Axis::Focus]) return refuse({Code::Unsupported, "this lens has no motorised focus"});
  if (auto unknown = PositionUnknown(Axis::Focus)) return refuse(*unknown);
  std::vector<drivers::Region> regions = request.regions;
  if (request.outside) {
    if (regions.empty()) regions.push_back({0.0, 0.0, 1.0, 1.0});
    if (regions.size() > 1 && request.outside->scores_only) {
      return refuse({Code::InvalidArgument, "several regions need pictures, not their sharpness"});
    }
  } else {
    const auto& camera = device.camera->capabilities();
    if (regions.empty()) regions.push_back(camera.focus_region);
    for (const drivers::Region& region : regions) {
      auto window = autofocus::WindowOf(region, camera.width, camera.height);
      if (!window) return refuse(window.error());
    }
  }
  if (request.track && (request.outside || regions.size() != 1)) {
    return refuse({Code::InvalidArgument, "tracking takes one region, and frames of the lens' own camera"});
  }
  if (request.deadline <= Duration::zero()) return refuse({Code::InvalidArgument, "a deadline must be above 0"});
  auto search_anew = [this, request, regions] {
    return autofocus::Regions::Create(request.method, AutofocusSetup(request), regions, request.policy);
  };
  auto search = search_anew();
  if (!search) return refuse(search.error());

  const bool focus_under_way = motions_[Axis::Focus] != nullptr;
  Disturb(Axis::Focus);
  if (focus_under_way && setups_[Axis::Focus]->can.can_stop) (void)device.lens->Stop(Axis::Focus);
  ++run_number_;
  run_motions_ = 0;
  autofocus_done_ = std::move(done);
  outside_.reset();
  if (request.outside) outside_.emplace(*std::move(request.outside));
  run_ = std::make_unique<AutofocusRun>(*std::move(search), clock.Now() + request.deadline, HandsOfRun(), ScaleOfRun(),
                                        std::move(progress));
  if (request.track) run_->Track({std::move(request.track), std::move(search_anew), request.deadline});
  run_->Begin();
}

// ---- frames from outside ------------------------------------------------------------------------------------------

void Rig::Impl::Give(Given given) {
  StopCallback refused;
  Result<void> taken = Fail(Code::InvalidArgument, "no autofocus that takes frames from outside is under way");
  if (outside_) {
    for (const drivers::Region& region : run_->regions()) {
      if (given.score) break;
      auto window = autofocus::WindowOf(region, given.frame.width, given.frame.height);
      if (!window) return Reply(std::move(given.taken), Result<void>(std::unexpected(window.error())));
    }
    taken = outside_->Take(std::move(given), refused);
  } else {
    refused = std::move(given.taken);
  }
  if (!taken) Reply(std::move(refused), std::move(taken));
}

/// Says where the next frame is wanted, and judges the one that came: it was exposed while the lens stood there if the
/// lens has been steady since before and a reading from afterwards still finds it so.
void Rig::Impl::ServeOutside() {
  if (!outside_ || !run_ || run_ended_ || !state_ || !state_->axes[Axis::Focus]) return;
  const auto steady = SteadySince();
  if (outside_->unannounced()) {
    FrameWanted wanted;
    wanted.number = run_->frames() + 1;
    wanted.frames_expected = run_->frames_expected();
    wanted.position = state_->axes[Axis::Focus]->position;
    if (optics && optics->has_focus()) {
      wanted.extension = optics->ExtensionFromNative(wanted.position);
      wanted.vergence = optics->VergenceFromExtension(*wanted.extension);
    }
    outside_->Announce(clock.Now(), steady, std::move(wanted));
  }
  if (!outside_->given()) return;
  if (state_->sampled_at < outside_->given()->frame.exposure_end) return;
  if (auto wrong = outside_->WhatIsWrong(steady)) {
    return Reply(outside_->Refuse(!steady), Result<void>(Fail(Code::InvalidArgument, *std::move(wrong))));
  }
  auto [given, seen] = outside_->Accept();
  Seen shown{.lensed = {.frame = std::move(given.frame), .axes = {}, .extension = {}, .f_number = {}},
             .score = given.score};
  for (const Axis axis : drivers::kAxes) {
    if (!state_->axes[axis]) continue;
    const Native stood = state_->axes[axis]->position;
    shown.lensed.axes[axis] = LensedFrame::AxisDuring{.lowest = stood, .highest = stood, .moving = false, .mid = stood};
  }
  Reply(std::move(given.taken), Result<void>());
  Reply(std::move(seen), Result<Seen>(std::move(shown)));
}

/// A frame that waits is told that nobody needs it any more.
void Rig::Impl::EndOutside() {
  if (outside_ && outside_->given()) {
    Reply(outside_->Refuse(false), Result<void>(Fail(Code::Cancelled, "the autofocus has ended")));
  }
  outside_.reset();
}

/// Ends the run from outside: superseded, stopped, or the lens is gone. Its motion of the focus axis ends unanswered.
void Rig::Impl::EndAutofocus(Result<AutofocusOutcome> end) {
  if (!run_ || run_ended_) return;
  run_.reset();
  EndOutside();
  DropMotion(Axis::Focus);
  looks_.ForgetAutofocus();
  Reply(std::exchange(autofocus_done_, nullptr), std::move(end));
}

}  // namespace lensd::rig
