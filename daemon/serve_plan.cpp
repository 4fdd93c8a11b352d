// Plan: solved here and now, in the event loop, because it takes microseconds; only applying it involves the worker.
#include <utility>

#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"
#include "move_group.h"
#include "proto/plan_json.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using proto::Json;

bool WantsApply(const ExchangePointer& exchange) {
  const auto apply = exchange->parameters().find("apply");
  return apply != exchange->parameters().end() && apply->is_boolean() && apply->get<bool>();
}

}  // namespace

void LensService::Plan(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  if (!lens->planning) {
    return Refuse(exchange, {Code::Unsupported, "the optics of lens \"" + lens->name +
                                                    "\" are not known; give it a [lens.optics] section"});
  }
  const auto request =
      proto::PlanRequestFromJson(exchange->parameters().find("request").value(), lens->planning->defaults);
  if (!request) return Refuse(exchange, request.error());
  const auto answer = optics::Plan(*request);
  if (!answer) return Refuse(exchange, answer.error());
  if (answer->feasible && WantsApply(exchange)) return Apply(exchange, *lens, *answer);
  const Json plan = proto::PlanAnswerJson(*answer, lens->planning->principal_gap);
  exchange->Finish("{\"plan\":" + proto::WriteJson(plan) + "}");
}

void LensService::Apply(const ExchangePointer& exchange, Lens& lens, const optics::PlanAnswer& plan) {
  auto group = std::make_shared<MoveGroup>(*lens.worker, lens.name);
  const Json json = proto::PlanAnswerJson(plan, lens.planning->principal_gap);
  group->OnEnd([this, exchange, &lens, json](const MoveGroup& ended) {
    if (ended.error()) return Refuse(exchange, *ended.error());
    AnnounceMoves(lens, ended.moves());
    exchange->Finish(proto::WriteJson({{"plan", json}, {"applied", ended.moves()}}));
  });
  const rig::Target focus{rig::Target::Kind::Extension, plan.extension.value, std::nullopt};
  const rig::Target iris{rig::Target::Kind::FNumber, plan.f_number.value, std::nullopt};
  lens.worker->Submit([group, focus, iris, planning = &*lens.planning](rig::Rig& rig) {
    if (planning->has_focus) rig.Move(Axis::Focus, focus, group->Add());
    if (planning->has_iris) rig.Move(Axis::Iris, iris, group->Add());
    group->Complete();
  });
}

}  // namespace lensd::daemon
