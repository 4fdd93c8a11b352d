// Autofocus with the lens' own camera.
#include <utility>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/pictures/picture.h"
#include "daemon/wire/autofocus_request.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/search_conditions_json.h"
#include "daemon/wire/target_json.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

/// The regions of a call, whether it gives one or several.
Result<std::vector<drivers::Region>> RegionsOf(const Json& parameters) {
  const Json* one = Given(parameters, "region");
  const Json* several = Given(parameters, "regions");
  std::vector<drivers::Region> regions;
  const auto add = [&](const Json& json, const std::string& path) -> Result<void> {
    const auto region = RegionOf(json, path);
    if (!region) return PassOn(region);
    regions.push_back(*region);
    return {};
  };
  if (one != nullptr && several != nullptr) {
    return PassOn(Wrong("give either one region or several regions, not both", {.parameter = "regions"}));
  }
  if (several != nullptr && several->empty()) {
    return PassOn(Wrong("regions is empty: leave it out for the default region", {.parameter = "regions"}));
  }
  if (one != nullptr) {
    if (auto added = add(*one, "region"); !added) return PassOn(added);
  }
  for (std::size_t i = 0; several != nullptr && i < several->size(); ++i) {
    if (auto added = add((*several)[i], "regions[" + std::to_string(i) + "]"); !added) return PassOn(added);
  }
  return regions;
}

constexpr double kLongestDeadlineMs = 3600e3;

Result<std::optional<Duration>> DeadlineOf(const Json& parameters) {
  const Json* given = Given(parameters, "deadlineMs");
  if (given == nullptr) return std::nullopt;
  const double milliseconds = given->get<double>();
  if (!(milliseconds > 0 && milliseconds <= kLongestDeadlineMs)) {
    return PassOn(Wrong("deadlineMs must be above 0 and at most 3600000, an hour",
                        {.parameter = "deadlineMs", .maximum = kLongestDeadlineMs, .unit = "ms"}));
  }
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(milliseconds));
}

Result<std::optional<rig::SearchStep>> StepOf(const Json& parameters) {
  using Kind = rig::SearchStep::Kind;
  struct Field {
    std::string_view name;
    Kind kind;
    double scale;
  };
  static constexpr Field kFields[] = {
      {"relative", Kind::Native, 1.0}, {"extensionUm", Kind::Extension, 1e-6}, {"blurPx", Kind::Blur, 1.0}};
  const Json* step = Given(parameters, "step");
  if (step == nullptr) return std::nullopt;
  std::optional<rig::SearchStep> found;
  int fields = 0;
  for (const Field& field : kFields) {
    const Json* value = Given(*step, field.name);
    if (value == nullptr) continue;
    ++fields;
    found = rig::SearchStep{field.kind, value->get<double>() * field.scale};
    if (!(found->value > 0)) {
      return PassOn(Wrong("a step must be above 0", {.parameter = "step." + std::string(field.name)}));
    }
  }
  if (fields != 1) return PassOn(Wrong("a step has exactly one field", {.parameter = "step"}));
  return found;
}

Result<std::optional<rig::SearchRange>> RangeOf(const Json& parameters) {
  const Json* range = Given(parameters, "range");
  if (range == nullptr) return std::nullopt;
  auto from = TargetOf((*range)["from"], OriginOf(parameters), "range.from");
  if (!from) return PassOn(from);
  auto to = TargetOf((*range)["to"], OriginOf(parameters), "range.to");
  if (!to) return PassOn(to);
  return rig::SearchRange{*from, *to};
}

}  // namespace

Result<rig::AutofocusRequest> AutofocusRequestOf(const Json& parameters) {
  rig::AutofocusRequest request;
  if (const Json* method = Given(parameters, "method")) request.method = method->get<std::string>();
  auto regions = RegionsOf(parameters);
  if (!regions) return PassOn(regions);
  request.regions = *std::move(regions);
  if (const Json* named = Given(parameters, "policy")) {
    auto policy = autofocus::PolicyFromName(named->get_ref<const std::string&>());
    if (!policy) return PassOn(policy);
    request.policy = *policy;
  }
  auto deadline = DeadlineOf(parameters);
  if (!deadline) return PassOn(deadline);
  request.deadline = *deadline;
  auto range = RangeOf(parameters);
  if (!range) return PassOn(range);
  request.range = *range;
  auto step = StepOf(parameters);
  if (!step) return PassOn(step);
  request.step = *step;
  if (const Json* conditions = Given(parameters, "conditions")) {
    auto set = SearchConditionsOf(*conditions, "conditions");
    if (!set) return PassOn(set);
    request.conditions = *set;
  }
  return request;
}

Error AsAskedOfAutofocus(const Error& error, const Json& parameters) {
  const std::string parameter = error.facts ? error.facts->parameter : "";
  if (parameter == "regions[0]" && Given(parameters, "regions") == nullptr) return Renamed("region", error);
  for (const char* end : {"from", "to"}) {
    if (parameter != "range." + std::string(end)) continue;
    return Renamed(TargetPath(parameter, parameters["range"][end]), error);
  }
  return error;
}

namespace {

// The rig may keep what tells it of progress beyond the end: a call that is answered drives the lens no longer.
using WeakExchange = std::weak_ptr<Exchange>;

/// Tells of each answer of an autofocus that goes on.
std::function<void(const rig::AutofocusOutcome&)> TrackTo(ServedLens& lens, WeakExchange call) {
  return [&lens, call = std::move(call)](const rig::AutofocusOutcome& outcome) {
    Worker::Later([&lens, call, outcome, result = AutofocusJson(lens.name(), outcome)] {
      NoteFocusTracked(lens, outcome);
      if (const auto exchange = call.lock()) exchange->Continue(Wrap("autofocus", varlink::WriteJson(result)));
      lens.watchers().Announce(lens, "autofocus", result);
    });
  };
}

rig::ProgressCallback ProgressTo(ServedLens& lens, WeakExchange call) {
  return [&lens, call = std::move(call)](const rig::AutofocusProgress& now) {
    Worker::Later([&lens, call, progress = AutofocusProgressJson(now)] {
      const auto exchange = call.lock();
      if (exchange && exchange->call().more) exchange->Continue(Wrap("progress", varlink::WriteJson(progress)));
      lens.watchers().TellProgress(lens, Procedure::Autofocus, progress);
    });
  };
}

void Autofocus(ServedLens& lens, const ExchangePointer& exchange) {
  Result<rig::AutofocusRequest> request = AutofocusRequestOf(exchange->parameters());
  if (!request) return Refuse(exchange, lens, request.error());
  if (const Json* track = Given(exchange->parameters(), "track"); track != nullptr && track->get<bool>()) {
    if (!exchange->call().more) return exchange->Refuse(varlink::kExpectedMore, Json::object());
    request->track = TrackTo(lens, exchange);
  }
  const auto told = [&lens, exchange, request = *request](const rig::AutofocusOutcome& outcome) {
    NoteFocusFound(lens, request, outcome);
    exchange->Finish(Wrap("autofocus", varlink::WriteJson(AutofocusJson(lens.name(), outcome))));
  };
  RunAutofocus(lens, exchange, *request, told);
}

}  // namespace

void RunAutofocus(ServedLens& lens, const ExchangePointer& exchange, rig::AutofocusRequest request,
                  AutofocusAnswer answer) {
  auto ended = std::make_shared<bool>(false);  // the worker's thread
  request.slopes = lens.users().slope->ForSearches();
  request.lags = lens.users().slope->lags();
  auto run = [request = std::move(request), progress = ProgressTo(lens, exchange), ended](rig::Rig& rig,
                                                                                          auto done) mutable {
    if (auto busy = rig.WhyNotFocused()) {
      *ended = true;
      return done(PassOn(*std::move(busy)));
    }
    rig.Autofocus(std::move(request), std::move(progress),
                  [ended, done = std::move(done)](Result<rig::AutofocusOutcome> outcome) mutable {
                    *ended = true;
                    done(std::move(outcome));
                  });
  };
  lens.Ask<rig::AutofocusOutcome>(
      std::move(run), [&lens, exchange, answer = std::move(answer)](const Result<rig::AutofocusOutcome>& outcome) {
        if (!outcome) return Refuse(exchange, lens, AsAskedOfAutofocus(outcome.error(), exchange->parameters()));
        answer(*outcome);
        lens.watchers().Announce(lens, "autofocus", AutofocusJson(lens.name(), *outcome));
      });
  // No caller is left to bring back what was set for the search: its end does, once the focus has stopped.
  std::vector<drivers::Axis> stopped;
  if (Given(exchange->parameters(), "conditions") != nullptr) stopped.push_back(drivers::Axis::Focus);
  exchange->OnGone([&lens, ended, stopped] { StopUnlessEnded(lens, ended, stopped); });
}

// The step in between lets commands taken before this one displace the autofocus first.
void StopUnlessEnded(ServedLens& lens, std::shared_ptr<const bool> ended, std::vector<drivers::Axis> axes) {
  lens.Ask<void>(
      [&clock = lens.surroundings().clock, ended = std::move(ended), axes = std::move(axes)](rig::Rig& rig, auto done) {
        rig.Step(clock.Now());
        if (!*ended) rig.Stop(axes, [](const Result<void>&) {});
        done(Result<void>());
      },
      [](const Result<void>&) {});
}

MethodTable AutofocusMethods(LensService& service) {
  return {{"Autofocus", service.ForLens(Autofocus)}};
}

}  // namespace lensd::daemon
