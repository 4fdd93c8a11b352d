// What an autofocus session is told about the lens, and what it may do with it. The run's own frames come from the
// lens' camera or are submitted from outside; either way it sees them with the lens state in force during their
// exposure.
#include "rig/autofocus/autofocus_job.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>
#include <utility>

#include "base/missing_optics.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr double kMs = 1e3;
constexpr Duration kUsual = std::chrono::seconds(20), kUsualOutside = std::chrono::minutes(1),
                   kLongestOutside = std::chrono::hours(1);

double Milliseconds(Duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

}  // namespace

// ---- what the session is told -------------------------------------------------------------------------------------

AutofocusRun::Scale AutofocusJob::Scale() const {
  const AxisSetup& setup = focus().setup();
  AutofocusRun::Scale scale{.resolution = setup.can.resolution};
  if (setup.backlash_known) scale.slack = setup.approach_up ? setup.backlash : -setup.backlash;
  const OpticsTable* optics = means_.optics.focus_table();
  // Depth from defocus knows lenses of one focal length: a liquid lens is searched in its own units.
  if (optics != nullptr && !optics->nominal().liquid) scale.optics = optics;
  const double rate = means_.camera != nullptr ? means_.camera->capabilities().frame_rate_hz : 0.0;
  if (setup.speed && rate > 0) {
    const double range = std::abs(scale.Position(setup.maximum) - scale.Position(setup.minimum));
    scale.stride = *setup.speed / rate * range / (setup.maximum - setup.minimum).value;
  }
  return scale;
}

autofocus::Setup AutofocusJob::SetupFor(const AutofocusRequest& request) const {
  const AxisSetup& axis = focus().setup();
  const AutofocusRun::Scale scale = Scale();
  autofocus::Setup setup;
  const auto [lowest, highest] = focus().SearchEnds();
  const double from = scale.Position(request.range ? Native{request.range->from.value} : lowest);
  const double to = scale.Position(request.range ? Native{request.range->to.value} : highest);
  std::tie(setup.lowest, setup.highest) = std::minmax({from, to});
  if (request.range) setup.ends = autofocus::Setup::Ends::Chosen;
  setup.resolution = std::abs(scale.Position(axis.minimum + Native{scale.resolution}) - scale.Position(axis.minimum));
  const double middle = 0.5 * (axis.minimum + axis.maximum).value;
  setup.backlash = std::abs(scale.Position(Native{middle + scale.slack}) - scale.Position(Native{middle}));
  const bool calibrated = scale.optics != nullptr;
  setup.near_is_high = calibrated || axis.direction.near_positive();
  setup.ascending = calibrated ? axis.direction.approach_near : axis.approach_up;
  const double pixel_m = (request.outside ? request.outside->pixel_um : means_.camera->capabilities().pixel_um) * 1e-6;
  setup.pictures = !request.outside || !request.outside->scores_only;
  setup.no_stride =
      request.outside ? "with client frames the position of the lens in motion is not known" : WhyNotInMotion();
  if (setup.no_stride.empty()) setup.stride = scale.stride;
  setup.pixel_m = pixel_m;
  const auto f_number = means_.optics.f_number();
  if (calibrated && f_number && pixel_m > 0) {
    setup.blur_px = f_number->value * pixel_m;
    setup.focal_length = scale.optics->FocalLengthAt(Metres{0.5 * (setup.lowest + setup.highest)}).value;
  }
  return setup;
}

/// Empty: frames of the moving focus axis can be told where it was.
std::string AutofocusJob::WhyNotInMotion() const {
  const AxisSetup& setup = focus().setup();
  if (!setup.can.follows()) return "this lens does not say where it is while it moves";
  if (!setup.speed) return "the speed of this lens is not known; speed in its [lens.focus] says it";
  if (!(means_.camera->capabilities().frame_rate_hz > 0)) return "this camera does not report its frame rate";
  return "";
}

Result<std::vector<drivers::Region>> AutofocusJob::RegionsFor(const AutofocusRequest& request) const {
  std::vector<drivers::Region> regions = request.regions;
  if (request.outside) {
    if (regions.empty()) regions.push_back({0.0, 0.0, 1.0, 1.0});
    if (regions.size() > 1 && request.outside->scores_only) {
      return Fail(Code::InvalidArgument, "several regions need pictures, not their sharpness");
    }
    return regions;
  }
  const auto& camera = means_.camera->capabilities();
  if (request.map) regions = autofocus::RegionsOf(*request.map);
  if (regions.empty()) regions.push_back(camera.focus_region);
  for (std::size_t i = 0; i < regions.size(); ++i) {
    auto window = autofocus::WindowOf(regions[i], camera.width, camera.height);
    if (window) continue;
    return Fail(window.error().code, window.error().message, {.parameter = "regions[" + std::to_string(i) + "]"});
  }
  return regions;
}

/// In the session's positions.
Result<double> AutofocusJob::StepFor(const SearchStep& step, const autofocus::Setup& setup) const {
  using Kind = SearchStep::Kind;
  static constexpr const char* kFields[] = {"step.relative", "step.extensionUm", "step.blurPx"};
  static constexpr double kShown[] = {1.0, 1e6, 1.0};  // of the step's unit in the field's
  const auto kind = static_cast<std::size_t>(step.kind);
  const AutofocusRun::Scale scale = Scale();
  double unit = setup.resolution / scale.resolution;
  if (step.kind == Kind::Extension) unit = 1.0;
  if (step.kind == Kind::Blur) unit = setup.blur_px.value_or(0.0);
  if ((step.kind == Kind::Extension && scale.optics == nullptr) || !(unit > 0.0)) {
    return Fail(Code::Unsupported,
                step.kind == Kind::Extension
                    ? OpticsMissing("give the step in native steps, such as 20steps: this lens' optics are")
                    : "give the step in native steps, such as 20steps: what a step does to blur takes optics, an "
                      "f-number and the pixels' size (pixel_um of the camera); " +
                          std::string(scale.optics == nullptr ? kConfigureOptics : "not all are known"),
                {.parameter = kFields[kind]});
  }
  const double wanted = step.value * unit;
  constexpr double kLeastIntervals = 4.0, kRounding = 1e-9;
  const double most = (setup.highest - setup.lowest) / kLeastIntervals;
  if (wanted >= setup.resolution * (1.0 - kRounding) && wanted <= most * (1.0 + kRounding)) return wanted;
  std::ostringstream text;
  text << "a step must be from one position to a quarter of the range: from " << setup.resolution / unit * kShown[kind]
       << " to " << most / unit * kShown[kind];
  const std::string name = step.kind == Kind::Native ? std::string(drivers::NativeUnitName(focus().setup().can.unit))
                           : step.kind == Kind::Extension ? "um"
                                                          : "px";
  return Fail(Code::OutOfRange, text.str() + " " + name,
              {.axis = "focus",
               .parameter = kFields[kind],
               .minimum = setup.resolution / unit * kShown[kind],
               .maximum = most / unit * kShown[kind],
               .unit = name});
}

/// Time for a search of the whole range: as many frames as the coarse pass of a sweep takes and the finer ones, each
/// with a short way to it, and four times the range.
Duration AutofocusJob::Needs(const autofocus::Setup& search, Duration each_frame) const {
  constexpr double kFiner = 100.0, kBlindFrames = 48.0, kCoarsePx = 10.0;
  constexpr double kShortWay = 0.1;  // s
  constexpr double kTravels = 4.0;
  const AxisSetup& axis = focus().setup();
  const double range = search.highest - search.lowest;
  const double usual = search.blur_px ? kCoarsePx * *search.blur_px : range / kBlindFrames;
  const double frames = kFiner + range / std::max(search.step.value_or(usual), search.resolution);
  const double native = range / search.resolution * Scale().resolution;
  const double travel = axis.speed && *axis.speed > 0 ? native / *axis.speed : 0.0;
  const double each = kShortWay + std::chrono::duration<double>(each_frame).count();
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(frames * each + kTravels * travel));
}

/// The time of a run whose caller sets no deadline, by how often frames have come from outside so far.
void AutofocusJob::FollowFrameRate() {
  if (!timed_) return;
  run_->Allow(std::clamp(Needs(*timed_, run_->elapsed() / (run_->frames() + 1)), kUsualOutside, kLongestOutside));
}

/// A frame wanted of a lens that stands is the one after the one under way: two periods. How often frames come from
/// outside shows when they come.
Result<void> AutofocusJob::AllowTime(const AutofocusRequest& request, AutofocusRun::Plan& plan) const {
  constexpr double kSlowest = 0.01;  // Hz: what is slower has told nonsense
  const double rate = request.outside ? 0.0 : means_.camera->capabilities().frame_rate_hz;
  const std::chrono::duration<double> period(rate > 0.0 ? 1.0 / std::max(rate, kSlowest) : 0.0);
  plan.usual = std::max(request.outside ? kUsualOutside : kUsual,
                        Needs(plan.setup, std::chrono::duration_cast<Duration>(2.0 * period)));
  plan.limit = request.deadline.value_or(plan.usual);
  const auto least = std::chrono::duration_cast<Duration>(plan.regions->frames_expected() * period);
  if (plan.limit >= least && plan.limit > Duration::zero()) return {};
  std::ostringstream text;
  text.precision(3);
  text << "a deadline of " << Milliseconds(plan.limit) << " ms is too short: ";
  if (plan.limit > Duration::zero()) {
    text << "the search takes " << plan.regions->frames_expected() << " frames of " << kMs * period.count()
         << " ms when all goes well, ";
  }
  text << "and up to " << Milliseconds(plan.usual) / kMs << " s where it has to search the whole range";
  return Fail(Code::OutOfRange, text.str(),
              {.axis = "focus", .parameter = "deadlineMs", .minimum = Milliseconds(least), .unit = "ms"});
}

Result<AutofocusRun::Plan> AutofocusJob::SearchFor(const AutofocusRequest& request) const {
  if (means_.camera == nullptr && !request.outside) {
    return Fail(Code::Unsupported,
                "this lens has no camera: autofocus needs one, or frames from outside (AutofocusBegin)");
  }
  if (!means_.axes[Axis::Focus]) return Fail(Code::Unsupported, "this lens has no motorised focus");
  if (auto unknown = focus().WhyUnknown()) return PassOn(*std::move(unknown));
  auto regions = RegionsFor(request);
  if (!regions) return PassOn(regions);
  if (request.track && (request.outside || regions->size() != 1)) {
    return Fail(Code::InvalidArgument, "tracking takes one region, and frames of the lens' own camera",
                {.parameter = "track"});
  }
  autofocus::Setup setup = SetupFor(request);
  const SlopeConditions under = Under(request.outside);
  const auto known = setup.blur_px && request.slopes ? request.slopes(under, *means_.optics.table()) : std::nullopt;
  if (known) autofocus::GoBy(*known, setup);
  if (request.track) setup.subject = autofocus::Setup::Subject::MayMove;
  if (!(setup.highest - setup.lowest > 0.5 * setup.resolution)) {
    return Fail(Code::InvalidArgument, "the range is a single position: there is nothing to search",
                {.parameter = "range"});
  }
  if (request.step) {
    auto step = StepFor(*request.step, setup);
    if (!step) return PassOn(step);
    setup.step = *step;
  }
  auto search = AutofocusRun::SearchOf(request, setup, Scale(), *std::move(regions));
  if (!search) return PassOn(search);
  AutofocusRun::Plan plan{.regions = *std::move(search), .setup = setup, .under = under, .known_slope = known};
  if (request.range) {
    plan.range = std::minmax(Native{request.range->from.value}, Native{request.range->to.value});
  }
  if (auto allowed = AllowTime(request, plan); !allowed) return PassOn(allowed);
  return plan;
}

// ---- from its beginning to its end --------------------------------------------------------------------------------

void AutofocusJob::Begin(AutofocusRequest request, AutofocusRun::Plan search, ProgressCallback progress,
                         AutofocusCallback done) {
  ++number_;
  ended_ = false;
  done_ = std::move(done);
  progress_ = progress ? std::make_shared<ProgressCallback>(std::move(progress)) : nullptr;
  tell_ = request.track;
  if (request.outside) external_.emplace(*request.outside);
  if (request.lags) lags_ = request.lags;
  timed_.reset();
  if (request.outside && !request.deadline) timed_ = search.setup;
  run_ = std::make_unique<AutofocusRun>(std::move(search), static_cast<FocusActuator&>(*this), Scale(),
                                        [this, request = std::move(request)] { return SearchFor(request); });
  if (tell_) run_->Track();
  run_->Begin(focus().state() ? focus().state()->position : Native{});
}

void AutofocusJob::Cancel(const Error& why) {
  if (!running()) return;
  EndExternal();
  run_.reset();
  (void)focus().End(AxisController::Outcome::CutShort);
  means_.frames.ForgetAutofocus();
  means_.replies.Add(std::exchange(done_, nullptr), Result<AutofocusOutcome>(PassOn(why)));
}

void AutofocusJob::End(Result<AutofocusOutcome> outcome) {
  ended_ = true;
  if (outcome && !HeldThroughout(*outcome)) outcome->slope.reset();
  if (outcome) NoteLag(*outcome);
  // A liquid lens is searched in its own units, and still focuses somewhere that is known.
  if (const auto* optics = means_.optics.focus_table(); outcome && !outcome->vergence && optics != nullptr) {
    const auto at = [&](Native position) {
      return optics->VergenceFromExtension(optics->ExtensionFromNative(position));
    };
    outcome->vergence = at(outcome->position);
    if (outcome->subject) outcome->subject->vergence = at(outcome->subject->position);
    for (AutofocusSample& sample : outcome->samples) sample.vergence = at(sample.position);
  }
  means_.frames.ForgetAutofocus();
  means_.replies.Add(std::exchange(done_, nullptr), std::move(outcome));
}

void AutofocusJob::Tidy() {
  if (!std::exchange(ended_, false)) return;
  EndExternal();
  run_.reset();
}

void AutofocusJob::Serve() {
  ServeExternal();
  if (running()) run_->CheckDeadline();
}

void AutofocusJob::Report(const AutofocusProgress& progress, std::move_only_function<void()> then) {
  if (progress_) means_.replies.Add([callback = progress_, progress] { (*callback)(progress); });
  means_.replies.Add([this, run = number_, then = std::move(then)]() mutable {
    if (running() && run == number_) then();
  });
}

void AutofocusJob::Tell(const AutofocusOutcome& answer) {
  NoteLag(answer);
  means_.replies.Add([tell = tell_, answer = answer, held = HeldThroughout(answer)]() mutable {
    if (!held) answer.slope.reset();
    tell(answer);
  });
}

// ---- what it may do with the lens ---------------------------------------------------------------------------------

template <class T>
auto AutofocusJob::OfThisRun(std::move_only_function<void(Result<T>)> callback) {
  return [this, run = number_, callback = std::move(callback)](Result<T> answer) mutable {
    if (running() && run == number_) callback(std::move(answer));
  };
}

void AutofocusJob::GiveUpMotion() {
  if (auto ended = focus().End(AxisController::Outcome::CutShort)) {
    means_.replies.Add(std::move(ended->done), Result<MoveOutcome>(Fail(Code::Superseded, "autofocus went elsewhere")));
  }
}

void AutofocusJob::MoveTo(Native target, Approach approach, MoveCallback done) {
  const AxisSetup& setup = focus().setup();
  GiveUpMotion();
  focus().Start({.target = std::clamp(target, setup.minimum, setup.maximum),
                 .overshoot = approach == Approach::AnyDirection ? 0.0 : setup.backlash,
                 .take_up = approach == Approach::Reapproach ? TakeUp::Always : TakeUp::FromBeyond,
                 .done = OfThisRun(std::move(done))});
}

/// A device without a choice of speeds goes in small even steps.
void AutofocusJob::SweepTo(Native target, double part_of_speed, MoveCallback done) {
  constexpr Duration kEach = std::chrono::milliseconds(4);
  const AxisSetup& setup = focus().setup();
  const double way = std::abs((target - focus().state()->position).value);
  const auto whole = std::chrono::duration<double>(way / (part_of_speed * *setup.speed));
  std::vector<Impulse> parts;
  if (part_of_speed < 1.0) parts = PacedParts(std::chrono::duration_cast<Duration>(whole), kEach);
  GiveUpMotion();
  focus().Start({.target = std::clamp(target, setup.minimum, setup.maximum),
                 .take_up = TakeUp::FromBeyond,
                 .parts = std::move(parts),
                 .done = OfThisRun(std::move(done))});
}

void AutofocusJob::RequestFrame(LensMotion lens, ObservationCallback done) {
  if (external_) return external_->Want(Now(), OfThisRun(std::move(done)));
  auto taken = [done = OfThisRun(std::move(done))](Result<LensedFrame> frame) mutable {
    if (!frame) return done(Result<Observation>(PassOn(frame)));
    done(Result<Observation>(Observation{*std::move(frame), std::nullopt}));
  };
  means_.frames.Add({.since = Now(), .for_autofocus = true, .lens = lens, .done = std::move(taken)});
}

// ---- frames from outside ------------------------------------------------------------------------------------------

Result<void> AutofocusJob::Check(const SubmittedFrame& frame) const {
  if (!external_) return Fail(Code::InvalidArgument, "no autofocus that takes frames from outside is under way");
  if (frame.score) return {};
  for (const drivers::Region& region : run_->regions()) {
    auto window = autofocus::WindowOf(region, frame.frame.width, frame.frame.height);
    if (!window) return PassOn(window);
  }
  return {};
}

void AutofocusJob::Submit(SubmittedFrame frame) {
  auto taken = Check(frame);
  if (taken) taken = external_->Check(frame);
  if (!taken) return means_.replies.Add(std::move(frame.taken), std::move(taken));
  external_->Take(std::move(frame));
}

/// Says where the next frame is wanted, and judges the one that came: it was exposed while the lens stood there if the
/// lens has been steady since before and a reading from afterwards still finds it so.
void AutofocusJob::ServeExternal() {
  if (!external_ || !running() || !focus().state()) return;
  const auto steady = means_.lens.SteadySince();
  if (external_->unannounced() && steady && *steady <= Now()) {
    FrameWanted wanted;
    wanted.number = run_->frames() + 1;
    wanted.frames_expected = run_->frames_expected();
    wanted.position = focus().state()->position;
    wanted.samples = run_->Samples();
    if (const OpticsTable* optics = means_.optics.focus_table()) {
      wanted.extension = optics->ExtensionFromNative(wanted.position);
      wanted.vergence = optics->VergenceFromExtension(*wanted.extension);
    }
    wanted.since = external_->Announce(*steady);
    if (const auto& tell = external_->camera().wanted) means_.replies.Add([tell, wanted] { tell(wanted); });
  }
  if (!external_->submitted() || *means_.lens.sampled_at() < external_->submitted()->frame.exposure_end) return;
  if (auto wrong = external_->WhatIsWrong(steady)) {
    if (!steady) external_->AnnounceAgain();
    return means_.replies.Add(external_->Refuse(), Result<void>(PassOn(*std::move(wrong))));
  }
  FollowFrameRate();
  auto [frame, done] = external_->Accept();
  Observation shown{.lensed = {.frame = std::move(frame.frame), .axes = {}, .extension = {}, .f_number = {}},
                    .score = frame.score};
  for (const Axis axis : drivers::kAxes) {
    if (!means_.axes[axis] || !means_.axes[axis]->state()) continue;
    const Native stood = means_.axes[axis]->state()->position;
    const Native bound{means_.axes[axis]->track().Bound() + means_.axes[axis]->track().adrift()};
    shown.lensed.axes[axis] = LensedFrame::AxisDuring{
        .lowest = stood, .highest = stood, .moving = false, .bound = bound, .mid = stood, .mid_bound = bound};
  }
  means_.replies.Add(std::move(frame.taken), Result<void>());
  means_.replies.Add(std::move(done), Result<Observation>(std::move(shown)));
}

/// A submitted frame that still waits is refused: no run needs it any more. The run is still there.
void AutofocusJob::EndExternal() {
  if (auto last = external_ ? run_->last_frame() : std::nullopt) last_frame_ = std::move(last);
  if (external_ && external_->submitted()) {
    means_.replies.Add(external_->Refuse(), Result<void>(Fail(Code::Cancelled, "the autofocus has ended")));
  }
  external_.reset();
}

}  // namespace lensd::rig
