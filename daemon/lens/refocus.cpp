// The worker may be busy with a caller's command when something is due: what is asked of it looks again there. The file
// of what was learned is written whole after each result; one that cannot be read is kept, and written no more.
#include "daemon/lens/refocus.h"

#include <array>
#include <memory>
#include <utility>

#include "daemon/lens/served_lens.h"
#include "daemon/state/lens_state_files.h"
#include "daemon/state/state_file.h"
#include "daemon/wire/json_values.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/refusal.h"

namespace lensd::daemon {
namespace {

using varlink::Json;
using End = rig::RefocusOutcome::End;

constexpr std::array<std::string_view, 4> kRefocusCauses = {"temperature", "time", "filter", "sharpness"};
constexpr std::array<std::string_view, 4> kRefocusEnds = {"moved", "searched", "refused", "failed"};

Json DriftJson(const rig::FocusDrift& drift) {
  return {{"umPerC", kUmPerMetre * drift.per_degree.value},
          {"lowUmPerC", kUmPerMetre * drift.low.value},
          {"highUmPerC", kUmPerMetre * drift.high.value},
          {"coldestC", drift.coldest.value},
          {"hottestC", drift.hottest.value},
          {"results", drift.used}};
}

Json DriftSampleJson(const rig::DriftSample& sample) {
  return {{"subject", sample.subject},
          {"temperatureC", sample.temperature.value},
          {"extensionUm", kUmPerMetre * sample.extension.value},
          {"sigmaUm", kUmPerMetre * sample.sigma.value},
          {"offUm", kUmPerMetre * sample.off.value},
          {"outlier", sample.outlier},
          {"made", sample.made}};
}

}  // namespace

void LensRefocus::Opened(Result<std::vector<rig::DriftSample>> learned) {
  const auto& config = lens_.config().rig.refocus;
  keeper_.reset();
  unreadable_ = learned ? std::nullopt : std::optional(learned.error());
  under_way_ = false;
  if (config) keeper_.emplace(*config, learned ? *std::move(learned) : std::vector<rig::DriftSample>{});
}

void LensRefocus::Found(const rig::AutofocusRequest& request, const rig::AutofocusOutcome& outcome) {
  if (!keeper_) return;
  const bool learned =
      keeper_->Found(request, outcome, lens_.status(), lens_.surroundings().clock.Now(), StateFileMoment());
  if (learned) Keep([](const Result<void>&) {});
  if (outcome.focused) Watch();
}

/// Shows the worker's frames to the watch of the focus that was reached. A lens without a camera has none.
void LensRefocus::Watch() {
  if (!keeper_->watch() || !lens_.status().has_camera) return;
  const auto watch = [reached = *keeper_->reached(), config = keeper_->config(), seen = keeper_->watch()](
                         rig::Rig& rig, auto done) { done(rig.View(rig::ViewerOf(rig, reached, config, seen))); };
  lens_.Ask<void>(watch, [](const Result<void>&) {});
}

/// Why what is due is not for now; empty: it is.
std::string LensRefocus::WhyWait() const {
  if (const auto absent = lens_.WhyAbsent()) return absent->message;
  if (lens_.users().stops.latched()) return "the lens was stopped for good";
  if (const Lease* lease = lens_.users().lease.now()) return "the lens is leased to " + lease->holder;
  return "";
}

void LensRefocus::Look() {
  if (!keeper_ || under_way_) return;
  if (keeper_->watch() && lens_.status().connected && keeper_->watch()->blind.exchange(false)) Watch();
  auto order = keeper_->Due(lens_.status(), lens_.surroundings().clock.Now(), WhyWait());
  if (!order) return;
  under_way_ = true;
  order->from.search.slopes = lens_.users().slope->ForSearches();
  order->from.search.lags = lens_.users().slope->lags();
  const rig::RefocusCause cause = order->cause;
  auto correct = [order = *std::move(order)](rig::Rig& rig, auto done) mutable {
    rig::Refocus(rig, std::move(order), std::move(done));
  };
  lens_.Ask<rig::RefocusOutcome>(std::move(correct),
                                 [this, cause](const Result<rig::RefocusOutcome>& outcome) { Ended(cause, outcome); });
}

void LensRefocus::Ended(rig::RefocusCause cause, const Result<rig::RefocusOutcome>& outcome) {
  under_way_ = false;
  if (!keeper_) return;
  const bool learned = keeper_->Ended(outcome, lens_.status(), lens_.surroundings().clock.Now(), StateFileMoment());
  if (learned) Keep([](const Result<void>&) {});
  if (outcome && outcome->search) lens_.users().slope->Found(*outcome->search);
  if (outcome && outcome->end == End::Searched) Watch();
  if (outcome || outcome.error().code != Code::Busy) Tell(cause, outcome);
}

void LensRefocus::Tell(rig::RefocusCause cause, const Result<rig::RefocusOutcome>& outcome) {
  const End end = outcome ? outcome->end : End::Failed;
  const rig::Status& status = lens_.status();
  const auto& focus = status.axes[drivers::Axis::Focus];
  last_ = {{"lens", lens_.name()},
           {"atNs", lens_.surroundings().clock.Now().time_since_epoch().count()},
           {"cause", NameIn(kRefocusCauses, cause)},
           {"end", NameIn(kRefocusEnds, end)},
           {"reason", outcome ? outcome->reason : outcome.error().message},
           {"temperatureC", Optional(status.temperature)},
           {"position", focus ? NativeJson(focus->position.value) : Json(nullptr)},
           {"byUm", outcome ? Optional(outcome->by, kUmPerMetre) : Json(nullptr)}};
  if (outcome && outcome->move) {
    lens_.watchers().AnnounceMoves(lens_, Json::array({MoveJson(lens_.name(), *outcome->move)}));
  }
  if (outcome && outcome->search) {
    lens_.watchers().Announce(lens_, "autofocus", AutofocusJson(lens_.name(), *outcome->search));
  }
  lens_.watchers().Announce(lens_, "refocus", last_);
}

varlink::Json LensRefocus::StateJson() const {
  Json json{{"lens", lens_.name()},   {"active", false},          {"reason", nullptr}, {"drift", nullptr},
            {"driftReason", nullptr}, {"results", Json::array()}, {"last", last_}};
  if (!keeper_) {
    json["reason"] = lens_.config().rig.refocus ? "the lens was not there yet" : "no [lens.refocus] is configured";
    return json;
  }
  json["active"] = keeper_->reached().has_value();
  json["reason"] = TextOrNull(under_way_ ? "one is under way" : keeper_->why_not());
  if (keeper_->drift()) json["drift"] = DriftJson(*keeper_->drift());
  if (!keeper_->drift()) json["driftReason"] = keeper_->drift().error().message;
  if (unreadable_) json["driftReason"] = unreadable_->message;
  for (const rig::DriftSample& sample : keeper_->learned()) json["results"].push_back(DriftSampleJson(sample));
  return json;
}

void LensRefocus::Forget(std::optional<std::int64_t> sample, const std::function<void(const Result<void>&)>& done) {
  const std::size_t count = keeper_ ? keeper_->learned().size() : 0;
  if (sample && (*sample < 1 || static_cast<std::size_t>(*sample) > count)) {
    return done(PassOn(Wrong("there is no result " + std::to_string(*sample) + ": there are " + std::to_string(count),
                             {.parameter = "result"})));
  }
  if (!keeper_) return done({});
  keeper_->Forget(sample ? std::optional(static_cast<std::size_t>(*sample - 1)) : std::nullopt);
  if (!sample) unreadable_.reset();  // a copy of that file is kept
  Keep(done);
}

void LensRefocus::Keep(const std::function<void(const Result<void>&)>& then) {
  if (unreadable_) return then(PassOn(*unreadable_));
  KeepStateFile(lens_, RefocusFile(lens_.config(), lens_.surroundings().state), rig::FocusDriftText(keeper_->learned()),
                "what was learned of focus", then);
}

}  // namespace lensd::daemon
