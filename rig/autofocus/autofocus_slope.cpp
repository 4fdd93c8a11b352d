// What an autofocus run says of the slope of blur: what it saw, under what, and whether that held until its end; and by
// how many frames pictures are late: what a run goes by, and what it leaves for later ones.
#include "rig/autofocus/autofocus_job.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

}  // namespace

std::optional<SlopeRun> AutofocusRun::ShownSlope(const autofocus::Verdict& verdict) const {
  if (!verdict.log_slope || scale_.optics == nullptr) return std::nullopt;
  const auto& known = search_.plan.known_slope;
  const auto told = ToldSlope(*scale_.optics, search_.plan.under, stands_);
  if (!told) return std::nullopt;
  return SlopeRun{.under = search_.plan.under,
                  .position = stands_,
                  .told_px = *told,
                  .log_factor = *verdict.log_slope + (known ? known->log_factor : 0.0),
                  .uneven = verdict.uneven};
}

SlopeConditions AutofocusJob::Under(const std::optional<OutsideCamera>& outside) const {
  SlopeConditions under;
  under.pixel_um = outside ? outside->pixel_um : means_.camera->capabilities().pixel_um;
  if (outside) under.frames = SlopeConditions::Frames::Outside;
  for (const auto& [axis, place] : {std::pair(Axis::Iris, &under.iris), std::pair(Axis::Zoom, &under.zoom)}) {
    const AxisController* motor = means_.axes[axis].get();
    if (motor == nullptr) continue;
    if (!motor->known() || motor->moving() || !motor->state()) {
      under.pixel_um = 0.0;
    } else {
      *place = motor->state()->position;
    }
  }
  return under;
}

/// Neither iris nor zoom have moved since the run began.
bool AutofocusJob::HeldThroughout(const AutofocusOutcome& outcome) const {
  if (!outcome.slope || means_.optics.focus_table() == nullptr) return false;
  const SlopeConditions now = Under(external_ ? std::optional(external_->camera()) : std::nullopt);
  return SlopeHoldsUnder(outcome.slope->under, now, *means_.optics.table());
}

LearnedLag::Camera AutofocusJob::LagCamera() const {
  if (external_) return {.outside = true, .pixel_um = external_->camera().pixel_um};
  return {.outside = false, .pixel_um = means_.camera->capabilities().pixel_um};
}

/// The lens' own camera, whose driver says when a frame was exposed, is in time until a search finds it late.
std::optional<int> AutofocusJob::lag_frames() const {
  if (external_ && external_->camera().lag_frames) return external_->camera().lag_frames;
  const auto learned = lags_->Of(LagCamera());
  return learned || external_ ? learned : 0;
}

/// A search that could not make sense of its frames leaves the lag in doubt, and so does a refused one with frames from
/// outside that were taken to be in time.
void AutofocusJob::NoteLag(const AutofocusOutcome& outcome) {
  using autofocus::Cause;
  auto lag = run_->lag_frames();
  const bool senseless = outcome.cause == Cause::SubjectMoved || outcome.cause == Cause::LateFrames;
  if (!outcome.focused && (senseless || (external_ && lag == 0))) lag.reset();
  lags_->Put(LagCamera(), lag);
}

}  // namespace lensd::rig
