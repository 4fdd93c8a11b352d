// Autofocus with the lens' own camera.
#include <utility>

#include "autofocus_request.h"
#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"
#include "proto/interfaces.h"

namespace lensd::daemon {

using proto::Json;

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
    return Fail(Code::InvalidArgument, "give either one region or several regions, not both");
  }
  if (region != nullptr) request.regions.push_back(RegionOf(*region));
  if (regions != nullptr) {
    if (regions->empty()) return Fail(Code::InvalidArgument, "regions is empty: leave it out for the default region");
    for (const Json& one : *regions) request.regions.push_back(RegionOf(one));
  }
  if (const Json* named = Given(parameters, "policy")) {
    auto policy = autofocus::PolicyFromName(named->get_ref<const std::string&>());
    if (!policy) return PassOn(std::move(policy));
    request.policy = *policy;
  }
  return request;
}

void LensService::Autofocus(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  Result<rig::AutofocusRequest> request = AutofocusRequestOf(exchange->parameters());
  if (!request) return Refuse(exchange, request.error());
  auto answer = [this, exchange, lens](const Result<rig::AutofocusOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, outcome.error());
    const std::string result = proto::WriteJson(AutofocusJson(lens->name, *outcome));
    exchange->Finish(Wrap("autofocus", result));
    Announce(*lens, "autofocus", result);
  };
  if (const Json* track = Given(exchange->parameters(), "track"); track != nullptr && track->get<bool>()) {
    if (!exchange->call().more) return exchange->Refuse(proto::kExpectedMore, Json::object());
    request->track = [this, lens, exchange](const rig::AutofocusOutcome& outcome) {
      lens->worker->Later([this, lens, exchange, text = proto::WriteJson(AutofocusJson(lens->name, outcome))] {
        exchange->Continue(Wrap("autofocus", text));
        Announce(*lens, "autofocus", text);
      });
    };
  }
  rig::ProgressCallback progress;
  if (exchange->call().more) {
    progress = [lens, exchange](const rig::AutofocusProgress& now) {
      lens->worker->Later([exchange, text = Wrap("progress", proto::WriteJson(AutofocusProgressJson(now)))] {
        exchange->Continue(text);
      });
    };
  }
  auto ended = std::make_shared<bool>(false);  // the worker's thread
  lens->worker->Submit(
      [lens, request = *std::move(request), progress = std::move(progress), answer, ended](rig::Rig& rig) mutable {
        rig.Autofocus(std::move(request), std::move(progress),
                      [lens, answer, ended](Result<rig::AutofocusOutcome> outcome) {
                        *ended = true;
                        lens->worker->Later([answer, outcome = std::move(outcome)] { answer(outcome); });
                      });
      });
  // Nobody is left to be told of the result. The step in between lets commands taken before this one displace the
  // autofocus first, so that the stop never hits the motion of somebody else.
  exchange->OnGone([this, lens, ended] {
    lens->worker->Submit([this, ended](rig::Rig& rig) {
      rig.Step(clock_.Now());
      if (!*ended) rig.Stop({}, [](const Result<void>&) {});
    });
  });
}

}  // namespace lensd::daemon
