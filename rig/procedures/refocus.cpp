// Where focus belongs after a change of temperature follows from where autofocus found it and what was learned; after a
// change of filter from the shift that was measured; in every other case the search that found it is made again. Any
// command for the focus from elsewhere ends that: its giver has another place in mind.
#include "rig/refocus.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "autofocus/measures.h"
#include "autofocus/regions.h"
#include "base/missing_optics.h"
#include "base/quantity_text.h"

namespace lensd::rig {
namespace {

using drivers::Axis;
using End = RefocusOutcome::End;

constexpr double kBeyond = 0.25;  ///< of the temperatures learned from: so far beyond them they still count
constexpr double kUm = 1e6;
constexpr int kMostDoublings = 5;
constexpr double kSqrt3 = 1.7320508;

std::optional<Native> PlaceOf(const Status& status, Axis axis) {
  return status.axes[axis] ? std::optional(status.axes[axis]->position) : std::nullopt;
}

bool Elsewhere(const std::optional<Native>& one, const std::optional<Native>& other, double within) {
  return one.has_value() != other.has_value() || (one && std::abs((*one - *other).value) > within);
}

bool FilterChanged(const FocusReached& from, const Status& status) {
  return Elsewhere(from.filter, PlaceOf(status, Axis::Filter), 0.5);
}

/// What positions mean whatever the temperature: what was learned must not hang on a coefficient that was told.
OpticsTable Uncorrected(const OpticsTable& table) {
  return table.In({.zoom = table.conditions().zoom, .filter = table.conditions().filter, .temperature = {}});
}

/// What one autofocus tells of the temperature; nothing: no thermometer, no optics, or it was not said how sure it is.
std::optional<DriftSample> SampleOf(const AutofocusOutcome& outcome, const Status& status) {
  const auto& subject = outcome.subject;
  const auto sigma = subject && subject->sigma ? subject->sigma : outcome.sigma;
  if (!status.temperature || !status.optics || !status.optics->has_focus() || !sigma) return std::nullopt;
  const OpticsTable table = Uncorrected(*status.optics);
  const Native position = subject ? subject->position : outcome.position;
  const Metres extension = table.ExtensionFromNative(position);
  const double to_sensor = (table.FocalLengthAt(extension) + extension).value;
  const Native stood = position + Native{status.axes[Axis::Focus]->bound.value / kSqrt3};
  const double by_motor = (table.ExtensionFromNative(stood) - extension).value;
  return DriftSample{.temperature = *status.temperature,
                     .extension = extension,
                     .sigma = Metres{std::max(std::hypot(sigma->value * to_sensor * to_sensor, by_motor), 1e-9)}};
}

bool SameRegion(const std::optional<drivers::Region>& one, const std::optional<drivers::Region>& other) {
  if (!one || !other) return one.has_value() == other.has_value();
  return one->x == other->x && one->y == other->y && one->width == other->width && one->height == other->height;
}

/// Why the focus that was reached is not lensd's to look after any more; empty: it is.
std::string WhyOver(const FocusReached& reached, const Status& status) {
  if (!status.connected) return "the lens was lost";
  const auto& focus = status.axes[Axis::Focus];
  if (!focus || !focus->homed) return "where focus stands is not known any more";
  if (focus->moved_by_another) return "focus was moved by hand or by another program";
  if (status.focus_commands.stops != reached.commands.stops) return "the lens was stopped";
  if (status.focus_commands != reached.commands) return "focus was moved by a command";
  const auto& zoom = status.axes[Axis::Zoom];
  if (zoom && Elsewhere(reached.zoom, zoom->position, 2.0 * zoom->bound.value)) return "the zoom was moved";
  return "";
}

/// Where a move goes, and why there.
struct Way {
  Native to;
  std::string why;
};

/// Or why a search is needed.
Result<Way> WayByTemperature(const Rig& rig, const RefocusOrder& order, const Status& status) {
  const OpticsTable* const optics = rig.optics();
  if (!order.how.move_within) return Fail(Code::Unsupported, "no move_within_um is configured");
  if (optics == nullptr || !optics->has_focus()) return Fail(Code::Unsupported, OpticsMissing("the optics are"));
  if (!order.drift) return PassOn(order.drift);
  const FocusDrift& drift = *order.drift;
  const double warmer = status.temperature->value - order.from.temperature->value;
  const double beyond = kBeyond * (drift.hottest.value - drift.coldest.value);
  if (*status.temperature < drift.coldest - Celsius{beyond} || *status.temperature > drift.hottest + Celsius{beyond}) {
    return Fail(Code::OutOfRange, Short(status.temperature->value) + " C is too far from what was learned from, " +
                                      Short(drift.coldest.value) + " to " + Short(drift.hottest.value) + " C");
  }
  const double unsure = 0.5 * (drift.high - drift.low).value * std::abs(warmer);
  if (unsure > order.how.move_within->value) {
    return Fail(Code::OutOfRange, "after " + Short(std::abs(warmer), 3) + " C what was learned is certain only to " +
                                      Short(kUm * unsure, 3) + " um");
  }
  const OpticsTable table = Uncorrected(*optics);
  const Metres by{-drift.per_degree.value * warmer};
  return Way{table.NativeFromExtension(table.ExtensionFromNative(order.from.position) + by),
             Short(std::abs(warmer), 3) + (warmer < 0.0 ? " C colder" : " C warmer") + " than when it was found, " +
                 Short(kUm * drift.per_degree.value, 3) + " um a degree, sure to " + Short(kUm * unsure, 2) + " um"};
}

Result<Way> WayByFilter(const Rig& rig, const RefocusOrder& order, const Status& status) {
  if (order.how.filter != RefocusConfig::OnFilter::Shift) return Fail(Code::Unsupported, "the filter is another one");
  const OpticsTable* const optics = rig.optics();
  const bool native = optics == nullptr || !optics->has_focus();
  FocusConditions from{.f_number = {}, .filter = order.from.filter, .focal_length = {}};
  FocusConditions to{.f_number = {}, .filter = PlaceOf(status, Axis::Filter), .focal_length = {}};
  if (optics != nullptr && optics->has_zoom()) from.focal_length = to.focal_length = optics->focal_length();
  const auto calibration = rig.calibration();
  const auto shift =
      ShiftBetween(calibration ? calibration->focus_shifts : std::vector<FocusShift>{}, from, to, native);
  if (!shift) return PassOn(shift);
  const Native here = status.axes[Axis::Focus]->position;
  if (native) return Way{here + Native{shift->value}, "the shift of focus that was measured"};
  return Way{optics->NativeFromExtension(optics->ExtensionFromNative(here) + Metres{shift->value}),
             "the shift of focus that was measured"};
}

Result<Way> WayFor(const Rig& rig, const RefocusOrder& order, const Status& status) {
  switch (order.cause) {
    case RefocusCause::Temperature:
      return WayByTemperature(rig, order, status);
    case RefocusCause::Filter:
      return WayByFilter(rig, order, status);
    case RefocusCause::Time:
      return Fail(Code::Unsupported, Short(std::chrono::duration<double>(*order.how.every).count()) + " s are over");
    case RefocusCause::Sharpness:
      break;
  }
  return Fail(Code::Unsupported, "the region in focus has lost sharpness");
}

/// By how much extension, as positions mean whatever the temperature; nothing: the optics are not known.
std::optional<Metres> Moved(const Rig& rig, Native from, Native to) {
  if (rig.optics() == nullptr || !rig.optics()->has_focus()) return std::nullopt;
  const OpticsTable table = Uncorrected(*rig.optics());
  return table.ExtensionFromNative(to) - table.ExtensionFromNative(from);
}

/// Another axis was commanded in the middle of a search: frames from before and after cannot be compared.
void PutBack(Rig& rig, Native stood, const std::string& why,
             std::move_only_function<void(Result<RefocusOutcome>)> done) {
  const Target target{.kind = Target::Kind::Native, .value = stood.value, .from = {}, .take_up = {}};
  rig.Move(Axis::Focus, target, [why, done = std::move(done)](Result<MoveOutcome> moved) mutable {
    if (!moved) return done(PassOn(moved));
    RefocusOutcome outcome{.end = End::Failed,
                           .reason = why + "; a command for another axis ended the search, and focus " +
                                     (moved->reached ? "is back where it was" : "did not get back: " + moved->reason)};
    outcome.commands = 2;
    outcome.move = *std::move(moved);
    done(std::move(outcome));
  });
}

}  // namespace

// ---- one correction -----------------------------------------------------------------------------------------------

void Refocus(Rig& rig, RefocusOrder order, std::move_only_function<void(Result<RefocusOutcome>)> done) {
  const Status status = rig.GetStatus();
  if (status.focus_commands != order.from.commands) {
    return done(Fail(Code::Superseded, "a command for the focus has come"));
  }
  if (auto busy = rig.WhyNotAtRest()) return done(PassOn(*std::move(busy)));
  if (status.held_until) return done(Fail(Code::Busy, "the lens is held"));
  const auto way = WayFor(rig, order, status);
  if (way) {
    const Target target{.kind = Target::Kind::Native, .value = way->to.value, .from = {}, .take_up = {}};
    const Native stood = status.axes[Axis::Focus]->position;
    return rig.Move(Axis::Focus, target,
                    [&rig, stood, way = *way, done = std::move(done)](Result<MoveOutcome> moved) mutable {
                      if (!moved) return done(PassOn(moved));
                      RefocusOutcome outcome{.end = moved->reached ? End::Moved : End::Failed, .reason = way.why};
                      if (!moved->reached) outcome.reason = "focus did not reach its position: " + moved->reason;
                      outcome.by = Moved(rig, stood, moved->position);
                      outcome.move = *std::move(moved);
                      done(std::move(outcome));
                    });
  }
  const CommandCount with_this{status.focus_commands.given + 1, status.focus_commands.stops};
  rig.Autofocus(std::move(order.from.search), nullptr,
                [&rig, with_this, stood = status.axes[Axis::Focus]->position, why = way.error().message,
                 done = std::move(done)](Result<AutofocusOutcome> found) mutable {
                  if (!found && found.error().code == Code::Superseded && rig.GetStatus().focus_commands == with_this) {
                    return PutBack(rig, stood, why, std::move(done));
                  }
                  if (!found) return done(PassOn(found));
                  RefocusOutcome outcome{.end = found->focused ? End::Searched : End::Refused, .reason = why};
                  if (!found->focused) outcome.reason += "; the search was refused: " + found->reason;
                  outcome.search = *std::move(found);
                  done(std::move(outcome));
                });
}

FrameViewer ViewerOf(const Rig& rig, const FocusReached& reached, const RefocusConfig& how,
                     std::shared_ptr<SharpnessWatch> watch) {
  const drivers::Region region = reached.region.value_or(rig.camera()->focus_region);
  return {.lens = LensMotion::Standing,
          .period = how.look_every,
          .show = [&rig, region, watch = std::move(watch)](const Result<LensedFrame>& seen) {
            if (!seen) watch->blind = true;
            if (watch->over || !seen) return false;
            if (rig.WhyNotFocused()) return true;  // a search takes frames that are out of focus
            const drivers::Frame& frame = seen->frame;
            const auto window = autofocus::WindowOf(region, frame.width, frame.height);
            const auto score = window ? autofocus::ScoreFocus(frame, *window) : PassOn(window);
            if (!score) return false;
            watch->lost =
                watch->tracker.Changed(*score, frame.bits, window->width * window->height, frame.exposure_end);
            return true;
          }};
}

SharpnessWatch::SharpnessWatch(double loss)
    : tracker({.dead_zone = loss,
               .shortest_pause = Duration::zero(),
               .watches = autofocus::TrackerSettings::Watches::Loss}) {
  tracker.SearchEnded(true, {});
}

std::vector<std::string> WhatRefocusLacks(const RefocusConfig& config, const RefocusMeans& means) {
  std::vector<std::string> lacks;
  const auto never = [&](const char* key, const char* why) {
    lacks.push_back(std::string("[lens.refocus] ") + key + " never starts anything: this lens " + why);
  };
  if (config.temperature && !means.thermometer) never("temperature_c", "does not report its temperature");
  if (config.filter != RefocusConfig::OnFilter::Ignore && !means.filter) never("filter", "has no filter");
  if (config.every && !means.camera) never("every_s", "has no camera to search with");
  if (config.sharpness_loss && !means.camera) never("sharpness_loss", "has no camera to see it");
  return lacks;
}

// ---- what is due --------------------------------------------------------------------------------------------------

RefocusKeeper::RefocusKeeper(const RefocusConfig& config, std::vector<DriftSample> learned)
    : config_(config), learned_(std::move(learned)), drift_(FitFocusDrift(learned_)) {
  for (const DriftSample& sample : learned_) subject_ = std::max(subject_, sample.subject);
}

void RefocusKeeper::GiveUp(std::string why) {
  reached_.reset();
  former_.reset();
  why_not_ = std::move(why);
  if (watch_) watch_->over = true;
  watch_.reset();
}

void RefocusKeeper::Forget(std::optional<std::size_t> sample) {
  if (sample) learned_.erase(learned_.begin() + static_cast<std::ptrdiff_t>(*sample));
  if (!sample) learned_.clear();
  drift_ = FitFocusDrift(learned_);
}

/// The same subject where nothing but autofocus has moved focus since, in the same region and conditions.
bool RefocusKeeper::Found(const AutofocusRequest& request, const AutofocusOutcome& outcome, const Status& status,
                          Instant now, std::string made) {
  if (!outcome.focused) return false;
  FocusReached reached;
  if (!request.outside) reached.search = request;
  reached.search.track = nullptr;
  if (reached.search.method == "auto") reached.search.method = "sweep";  // which ends at one place from either side
  if (!request.outside && outcome.subject && !outcome.regions.empty()) {
    reached.region = outcome.regions.at(static_cast<std::size_t>(outcome.subject->region));
  }
  reached.commands = status.focus_commands;
  reached.found = now;
  auto& before = reached_ ? reached_ : former_;
  if (before) ++before->commands.given;  // this one
  const bool undisturbed = before && WhyOver(*before, status).empty() && SameRegion(before->region, reached.region);
  if (!undisturbed) ++subject_;
  if (!reached_) reached_ = former_;
  former_.reset();
  tried_ = now;
  failures_ = 0;
  // Depth from defocus stops short of where it would end coming from the other side: by less than its sigma, and toward
  // where it began, so that a coefficient learned from it came out a quarter too small.
  return Adopt(std::move(reached), outcome, status, request.method == "auto" ? std::nullopt : std::optional(made));
}

bool RefocusKeeper::Adopt(FocusReached reached, const AutofocusOutcome& outcome, const Status& status,
                          std::optional<std::string> made) {
  reached.position = outcome.position;
  reached.temperature = reached.corrected_at = status.temperature;
  reached.filter = PlaceOf(status, Axis::Filter);
  reached.zoom = PlaceOf(status, Axis::Zoom);
  reached.f_number = status.f_number;
  const bool other_iris =
      reached_ && reached_->f_number && reached.f_number && !SameFNumber(*reached_->f_number, *reached.f_number);
  const bool otherwise = reached_ && (other_iris || reached_->method != outcome.method ||
                                      Elsewhere(reached_->filter, reached.filter, 0.5));
  if (otherwise) ++subject_;
  reached.method = outcome.method;
  reached_ = std::move(reached);
  why_not_.clear();
  if (watch_) watch_->over = true;
  watch_ = config_.sharpness_loss ? std::make_shared<SharpnessWatch>(*config_.sharpness_loss) : nullptr;
  auto sample = made ? SampleOf(outcome, status) : std::nullopt;
  if (!sample) return false;
  sample->subject = std::max(subject_, 1);
  sample->made = *std::move(made);
  if (learned_.size() >= DriftSample::kMost) learned_.erase(learned_.begin());
  learned_.push_back(*std::move(sample));
  drift_ = FitFocusDrift(learned_);
  return true;
}

std::optional<RefocusCause> RefocusKeeper::CauseOf(const Status& status, Instant now) const {
  if (config_.filter != RefocusConfig::OnFilter::Ignore && FilterChanged(*reached_, status)) {
    return RefocusCause::Filter;
  }
  if (config_.temperature && status.temperature && reached_->corrected_at &&
      std::abs((*status.temperature - *reached_->corrected_at).value) >= config_.temperature->value) {
    return RefocusCause::Temperature;
  }
  if (watch_ && watch_->lost) return RefocusCause::Sharpness;
  if (config_.every && now - reached_->found >= *config_.every) return RefocusCause::Time;
  return std::nullopt;
}

std::optional<RefocusOrder> RefocusKeeper::Due(const Status& status, Instant now, const std::string& waits) {
  if (!reached_) return std::nullopt;
  if (const std::string over = WhyOver(*reached_, status); !over.empty()) {
    const FocusReached before = *std::move(reached_);
    GiveUp(over + ": it is left alone until the next autofocus");
    // It may be one: then that goes on from here.
    const CommandCount next{before.commands.given + 1, before.commands.stops};
    if (status.focus_commands == next) former_ = before;
    return std::nullopt;
  }
  why_not_.clear();
  const auto cause = CauseOf(status, now);
  if (!cause) return std::nullopt;
  const Duration pause = config_.minimum_interval * (1 << std::min(failures_, kMostDoublings));
  if (!waits.empty()) {
    why_not_ = waits;
  } else if (status.held_until) {
    why_not_ = "the lens is held";
  } else if (status.activity.kind != Activity::Kind::Idle) {
    why_not_ = "something is under way";
  } else if (tried_ && now < *tried_ + pause) {
    why_not_ = "the last one was too short a time ago";
  }
  if (!why_not_.empty()) return std::nullopt;
  return RefocusOrder{.cause = *cause, .from = *reached_, .how = config_, .drift = drift_};
}

bool RefocusKeeper::Ended(const Result<RefocusOutcome>& outcome, const Status& status, Instant now, std::string made) {
  if (!outcome && outcome.error().code == Code::Busy) return false;  // it waits
  tried_ = now;
  const bool good = outcome && (outcome->end == End::Moved || outcome->end == End::Searched);
  failures_ = good ? 0 : failures_ + 1;
  if (!reached_) return false;
  if (!outcome && (outcome.error().code == Code::Cancelled || outcome.error().code == Code::Superseded)) {
    GiveUp(outcome.error().code == Code::Cancelled ? "a refocus was stopped: it is left alone until the next autofocus"
                                                   : "focus was moved by a command: it is left alone until the next "
                                                     "autofocus");
    return false;
  }
  if (!outcome) {
    // It was refused at once, and then it is not counted, or failed under way.
    const CommandCount next{reached_->commands.given + 1, reached_->commands.stops};
    if (status.focus_commands == next) reached_->commands = next;
    return false;
  }
  FocusReached reached = *reached_;
  reached.commands.given += outcome->commands;
  if (outcome->end == End::Searched) {
    reached.found = now;
    return Adopt(std::move(reached), *outcome->search, status, std::move(made));
  }
  if (outcome->end == End::Moved) {
    reached.corrected_at = status.temperature;
    if (FilterChanged(reached, status)) {
      reached.filter = PlaceOf(status, Axis::Filter);
      reached.position = outcome->move->position;
      reached.temperature = status.temperature;
    }
  }
  reached_ = std::move(reached);
  return false;
}

}  // namespace lensd::rig
