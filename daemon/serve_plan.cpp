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

bool WantsApply(const ExchangePointer& exchange) {
  const auto apply = exchange->view().Given("apply");
  return apply && apply->boolean();
}

/// The reply's `plan`, and `nearest` where only the lens' steps stand in the way, without the closing brace.
std::string PlanReply(const optics::GridAnswer& answer, Metres principal_gap) {
  const bool by_steps = !answer.plan.feasible && answer.continuous_feasible;
  if (!by_steps) return "{\"plan\":" + proto::PlanAnswerText(answer.plan, principal_gap);
  optics::PlanAnswer plan = answer.plan;
  plan.conflict = {"positions"};
  plan.relax = plan.worst_ratio;
  plan.note = "some setting meets every limit, but none of the positions this lens can take does; see the nearest";
  return "{\"plan\":" + proto::PlanAnswerText(plan, principal_gap) +
         ",\"nearest\":" + proto::PlanAnswerText(answer.plan, principal_gap, proto::PlanShows::Setting);
}

}  // namespace

void LensService::Plan(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  if (!lens->planning) {
    return Refuse(exchange, {Code::Unsupported, "the optics of lens \"" + lens->name +
                                                    "\" are not known; give it a [lens.optics] section"});
  }
  if (Stale(*lens)) return Replan(*lens, [this, exchange] { Plan(exchange); });
  auto request = proto::PlanRequestFromJson(*exchange->view().Find("request"), lens->planning->defaults);
  if (!request) return Refuse(exchange, request.error());
  const auto plan = PlanFor(*lens->planning, *request);
  if (!plan) return Refuse(exchange, plan.error());
  if (plan->answer.plan.feasible && WantsApply(exchange)) return Apply(exchange, *lens, *std::move(request), *plan);
  exchange->Finish(PlanReply(plan->answer, lens->planning->principal_gap) + "}");
}

void LensService::Apply(const ExchangePointer& exchange, Lens& lens, optics::PlanRequest request,
                        const LensPlan& plan) {
  auto group = std::make_shared<MoveGroup>(*lens.worker, lens.name);
  group->OnEnd([this, exchange, &lens, request = std::move(request), plan](const MoveGroup& ended) {
    if (ended.error()) return Refuse(exchange, *ended.error());
    AnnounceMoves(lens, ended.moves());
    std::string reply = PlanReply(plan.answer, lens.planning->principal_gap);
    reply += ",\"applied\":" + proto::WriteJson(ended.moves());
    Metres extension = plan.answer.plan.extension, bound{lens.planning->defaults.sensor_tolerance.value};
    FNumber f_number = plan.answer.plan.f_number;
    for (const rig::MoveOutcome& outcome : ended.outcomes()) {
      const auto& optics = lens.status->optics;
      if (optics && outcome.extension) extension = PlanExtension(*optics, *outcome.extension);
      if (optics) bound = PlanBound(*optics, outcome).value_or(bound);
      f_number = outcome.f_number.value_or(f_number);
    }
    if (const auto reached = PlanAt(*lens.planning, request, extension, bound, f_number)) {
      reply += ",\"reached\":" + proto::PlanAnswerText(*reached, lens.planning->principal_gap);
    }
    exchange->Finish(reply + "}");
  });
  lens.worker->Submit([group, focus = plan.focus, iris = plan.iris](rig::Rig& rig) {
    if (focus) rig.Move(Axis::Focus, {rig::Target::Kind::Native, focus->value, std::nullopt}, group->Add());
    if (iris) rig.Move(Axis::Iris, {rig::Target::Kind::Native, iris->value, std::nullopt}, group->Add());
    group->Complete();
  });
}

}  // namespace lensd::daemon
