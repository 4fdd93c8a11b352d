// Searches look at what was learned from their worker's thread, so that it is replaced whole. Its file is written after
// each run that taught something; one that cannot be read is kept, and written no more.
#include "daemon/lens/lens_slope.h"

#include <cmath>
#include <utility>

#include "base/missing_optics.h"
#include "daemon/events/log.h"
#include "daemon/lens/served_lens.h"
#include "daemon/state/state_file.h"
#include "daemon/wire/json_values.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {
namespace {

using rig::LearnedSlope;
using varlink::Json;

constexpr double kSigmasOf95 = 1.96;

Json KnownSlopeJson(const std::optional<autofocus::KnownSlope>& known) {
  if (!known) return nullptr;
  return {{"factor", std::exp(known->log_factor)},
          {"low", std::exp(known->log_factor - kSigmasOf95 * known->sigma)},
          {"high", std::exp(known->log_factor + kSigmasOf95 * known->sigma)},
          {"runs", known->runs},
          {"uneven", known->uneven ? Json(std::exp(2.0 * kSigmasOf95 * *known->uneven)) : Json(nullptr)}};
}

/// By the rule by which what was learned ends.
bool ShowsAnotherLens(const rig::AutofocusOutcome& outcome) {
  const auto& known = outcome.known_slope;
  return known && outcome.slope &&
         autofocus::IsOfAnotherLens(outcome.slope->log_factor - known->log_factor, known->sigma);
}

/// With the frames that the newest run had: a search with frames from outside goes by what those taught.
rig::SlopeConditions AsLastSeen(rig::SlopeConditions now, const std::vector<rig::SlopeRun>& runs) {
  using Frames = rig::SlopeConditions::Frames;
  if (!runs.empty() && runs.back().under.frames == Frames::Outside) {
    now.frames = Frames::Outside;
    now.pixel_um = runs.back().under.pixel_um;
  }
  return now;
}

}  // namespace

Json AutofocusSlopeJson(const rig::AutofocusOutcome& outcome) {
  if (!outcome.slope && !outcome.known_slope) return nullptr;
  return {{"shown", outcome.slope ? Json(std::exp(outcome.slope->log_factor)) : Json(nullptr)},
          {"known", KnownSlopeJson(outcome.known_slope)},
          {"anotherLens", ShowsAnotherLens(outcome)}};
}

void LensSlope::Opened(Result<std::vector<rig::SlopeRun>> learned, std::string file) {
  unreadable_ = learned ? std::nullopt : std::optional(learned.error());
  file_ = std::move(file);
  lags_->Forget();
  learned_->Put(LearnedSlope(learned ? *std::move(learned) : std::vector<rig::SlopeRun>{}));
}

rig::KnownSlopes LensSlope::ForSearches() const {
  if (!lens_.config().rig.use_learned_slope) return nullptr;
  return [learned = learned_](const rig::SlopeConditions& under, const rig::OpticsTable& optics) {
    return learned->Get()->Known(under, optics);
  };
}

/// A search that was refused has proved no top, and what frames show beside one is no slope.
void LensSlope::Found(const rig::AutofocusOutcome& outcome) {
  const auto& optics = lens_.status().optics;
  if (!outcome.focused || !outcome.slope || !optics) return;
  rig::SlopeRun run = *outcome.slope;
  run.made = StateFileMoment();
  LearnedSlope learned = *learned_->Get();
  if (learned.Add(std::move(run), *optics) == autofocus::SlopeLearner::Learned::AnotherLens) {
    Log(Severity::Warning, Event::SlopeForgotten,
        "blur grows differently than in earlier autofocus runs, as with another lens: what was learned of the lens is "
        "forgotten",
        {.lens = lens_.name(), .axis = "focus"});
  }
  Put(std::move(learned), [](const Result<void>&) {});
}

void LensSlope::Put(LearnedSlope learned, const std::function<void(const Result<void>&)>& then) {
  const std::string text = rig::LearnedSlopeText(learned.runs());
  learned_->Put(std::move(learned));
  if (unreadable_) return then(PassOn(*unreadable_));
  KeepStateFile(lens_, file_, text, "what was learned of blur", then);
}

Json LensSlope::StateJson(const std::optional<rig::SlopeConditions>& now, const rig::OpticsTable* optics) const {
  const auto learned = learned_->Get();
  const auto under = now && optics != nullptr ? std::optional(AsLastSeen(*now, learned->runs())) : std::nullopt;
  const auto known = under ? learned->Known(*under, *optics) : std::nullopt;
  Json json{{"lens", lens_.name()}, {"known", KnownSlopeJson(known)}, {"reason", nullptr}, {"runs", Json::array()}};
  json["lags"] = LagsJson();
  std::size_t count = 0;
  for (const rig::SlopeRun& run : learned->runs()) {
    const bool holds = under && rig::SlopeHoldsUnder(run.under, *under, *optics);
    count += holds ? 1 : 0;
    const bool outside = run.under.frames == rig::SlopeConditions::Frames::Outside;
    json["runs"].push_back({{"shown", std::exp(run.log_factor)},
                            {"position", NativeJson(run.position.value)},
                            {"blurPxPerUnit", run.told_px * std::exp(run.log_factor)},
                            {"pixelUm", run.under.pixel_um},
                            {"irisPosition", run.under.iris ? NativeJson(run.under.iris->value) : Json(nullptr)},
                            {"zoomPosition", run.under.zoom ? NativeJson(run.under.zoom->value) : Json(nullptr)},
                            {"framesFromOutside", outside},
                            {"aboveOverBelow", run.uneven ? Json(std::exp(2.0 * *run.uneven)) : Json(nullptr)},
                            {"holds", holds},
                            {"made", run.made}});
  }
  if (optics == nullptr) {
    json["reason"] = OpticsMissing("the optics are");
  } else if (!now) {
    json["reason"] = "an axis has no reference, so that it is not known which results apply: home it";
  } else if (!known) {
    json["reason"] = "it takes " + std::to_string(autofocus::SlopeLearner::kFewest) +
                     " runs in the present state of the lens, and there are " + std::to_string(count);
  }
  if (unreadable_) json["reason"] = unreadable_->message;
  return json;
}

Json LensSlope::LagsJson() const {
  Json json = Json::array();
  for (const auto& [camera, frames] : lags_->All()) {
    json.push_back({{"framesFromOutside", camera.outside}, {"pixelUm", camera.pixel_um}, {"frames", frames}});
  }
  return json;
}

void LensSlope::Forget(const std::function<void(const Result<void>&)>& done) {
  lags_->Forget();
  unreadable_.reset();  // a copy of that file is kept
  Put({}, done);
}

}  // namespace lensd::daemon
