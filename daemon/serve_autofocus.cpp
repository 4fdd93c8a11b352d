// Autofocus with the lens' own camera.
#include <utility>

#include "autofocus_request.h"
#include "lens_json.h"
#include "lens_service.h"
#include "proto/interfaces.h"
#include "serve.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

drivers::Region RegionOf(const Json& region) {
  const auto number = [&](const char* key) { return region[key].get<double>(); };
  return {number("x"), number("y"), number("w"), number("h")};
}

}  // namespace

Result<rig::AutofocusRequest> AutofocusRequestOf(const Json& parameters) {
  rig::AutofocusRequest request;
  if (const Json* method = Given(parameters, "method")) request.method = method->get<std::string>();
  const Json* region = Given(parameters, "region");
  const Json* regions = Given(parameters, "regions");
  if (region != nullptr && regions != nullptr) {
    return PassOn(Wrong("give either one region or several regions, not both", {.parameter = "regions"}));
  }
  if (region != nullptr) request.regions.push_back(RegionOf(*region));
  if (regions != nullptr) {
    if (regions->empty()) {
      return PassOn(Wrong("regions is empty: leave it out for the default region", {.parameter = "regions"}));
    }
    for (const Json& one : *regions) request.regions.push_back(RegionOf(one));
  }
  if (const Json* named = Given(parameters, "policy")) {
    auto policy = autofocus::PolicyFromName(named->get_ref<const std::string&>());
    if (!policy) return PassOn(policy);
    request.policy = *policy;
  }
  return request;
}

namespace {

/// Tells of each answer of an autofocus that goes on.
std::function<void(const rig::AutofocusOutcome&)> TrackTo(ServedLens& lens, const ExchangePointer& exchange) {
  return [&lens, exchange](const rig::AutofocusOutcome& outcome) {
    lens.Later([&lens, exchange, result = AutofocusJson(lens.name(), outcome)] {
      exchange->Continue(Wrap("autofocus", varlink::WriteJson(result)));
      lens.watchers().Announce(lens, "autofocus", result);
    });
  };
}

rig::ProgressCallback ProgressTo(ServedLens& lens, const ExchangePointer& exchange) {
  return [&lens, exchange](const rig::AutofocusProgress& now) {
    lens.Later([&lens, exchange, progress = AutofocusProgressJson(now)] {
      if (exchange->call().more) exchange->Continue(Wrap("progress", varlink::WriteJson(progress)));
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
  auto ended = std::make_shared<bool>(false);  // the worker's thread
  auto run = [request = *std::move(request), progress = ProgressTo(lens, exchange), ended](rig::Rig& rig,
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
  lens.Ask<rig::AutofocusOutcome>(std::move(run), [&lens, exchange](const Result<rig::AutofocusOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, lens, outcome.error());
    const varlink::Json result = AutofocusJson(lens.name(), *outcome);
    exchange->Finish(Wrap("autofocus", varlink::WriteJson(result)));
    lens.watchers().Announce(lens, "autofocus", result);
  });
  exchange->OnGone([&lens, ended] { StopUnlessEnded(lens, ended, {}); });
}

}  // namespace

// The step in between lets commands taken before this one displace the autofocus first.
void StopUnlessEnded(ServedLens& lens, std::shared_ptr<const bool> ended, std::vector<drivers::Axis> axes) {
  lens.Submit([&clock = lens.surroundings().clock, ended = std::move(ended), axes = std::move(axes)](rig::Rig& rig) {
    rig.Step(clock.Now());
    if (!*ended) rig.Stop(axes, [](const Result<void>&) {});
  });
}

MethodTable AutofocusMethods(LensService& service) {
  return {{"Autofocus", service.ForLens(Autofocus), NeedsLease::Yes, MayChangeState::Yes, Acts::InTurn, Streams::Yes}};
}

}  // namespace lensd::daemon
