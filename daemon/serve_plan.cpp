// Plan: solved here and now, in the event loop, because it takes microseconds; only choosing a focal length and
// applying a plan involve the worker.
#include <utility>

#include "lens_json.h"
#include "lens_service.h"
#include "move_group.h"
#include "proto/plan_json.h"
#include "serve.h"
#include "zoom_choice.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using varlink::Json;

bool Says(const ExchangePointer& exchange, std::string_view flag) {
  const auto given = exchange->view().Given(flag);
  return given && given->boolean();
}

/// Where to move for it, as fields of an object that is still open.
std::string Places(const LensPlan& plan) {
  std::string text;
  if (plan.zoom) text += ",\"zoomPosition\":" + varlink::WriteJson(NativeJson(plan.zoom->value));
  if (plan.field_width) text += ",\"fieldWidthM\":" + varlink::WriteJson(Json(plan.field_width->value));
  if (plan.focus) text += ",\"focusPosition\":" + varlink::WriteJson(NativeJson(plan.focus->value));
  if (plan.iris) text += ",\"irisPosition\":" + varlink::WriteJson(NativeJson(plan.iris->value));
  return text;
}

/// An answer with more fields.
std::string With(std::string answer, const std::string& fields) {
  answer.pop_back();
  return answer + fields + "}";
}

/// The reply's `plan`, and `nearest` where only the lens' steps stand in the way, without the closing brace.
std::string PlanReply(const LensPlan& plan, Metres principal_gap) {
  const optics::PlanAnswer& answer = plan.answer.plan;
  if (answer.feasible) {
    return "{\"plan\":" + With(proto::PlanAnswerText(answer, principal_gap), Places(plan));
  }
  if (!plan.answer.continuous_feasible) return "{\"plan\":" + proto::PlanAnswerText(answer, principal_gap);
  optics::PlanAnswer refusal;
  refusal.conflict = {"positions"};
  refusal.relax = answer.worst_ratio;
  refusal.note = "some setting meets every limit, but none of the positions this lens can take does; see the nearest";
  return "{\"plan\":" + proto::PlanAnswerText(refusal, principal_gap) +
         ",\"nearest\":" + With(proto::PlanAnswerText(answer, principal_gap, proto::PlanShows::Setting), Places(plan));
}

Json StackReply(const LensStack& stack) {
  const optics::StackAnswer& answer = stack.answer.stack;
  if (!answer.feasible) {
    return {{"feasible", false},
            {"shots", Json::array()},
            {"cause", optics::StackCauseName(answer.cause)},
            {"reason", answer.reason}};
  }
  Json shots = Json::array();
  for (std::size_t i = 0; i < answer.shots.size(); ++i) {
    const optics::StackShot& shot = answer.shots[i];
    shots.push_back({{"fNumber", shot.f_number.value},
                     {"extensionMm", shot.extension.value * 1e3},
                     {"focalLengthMm", stack.shots[i].focal_length.value * 1e3},
                     {"nearD", varlink::NumberOrNull(shot.near.value)},
                     {"farD", varlink::NumberOrNull(shot.far.value)},
                     {"magnification", shot.magnification},
                     {"focusPosition", stack.focus.empty() ? Json(nullptr) : NativeJson(stack.focus[i].value)},
                     {"irisPosition", stack.iris ? NativeJson(stack.iris->value) : Json(nullptr)}});
  }
  return {{"feasible", true}, {"shots", std::move(shots)}};
}

struct Question {
  proto::LensRequest asked;
  bool apply = false;
  bool shows_request = false;

  std::string Shown(const LensPlan& plan) const {
    if (!shows_request) return "";
    return ",\"request\":" + varlink::WriteJson(proto::PlanRequestJson(plan.answer.request));
  }
};

void Apply(ServedLens& lens, const ExchangePointer& exchange, const Question& question, const LensPlan& plan) {
  if (auto why = lens.WhyStopped(exchange->number(), std::nullopt)) return Refuse(exchange, *why);
  const auto move = [plan](rig::Rig& rig, MovesCallback done) {
    const auto group = std::make_shared<MoveGroup>(std::move(done));
    for (const auto& [axis, place] :
         {std::pair(Axis::Zoom, plan.zoom), std::pair(Axis::Focus, plan.focus), std::pair(Axis::Iris, plan.iris)}) {
      if (place) rig.Move(axis, {rig::Target::Kind::Native, place->value, std::nullopt}, group->Add());
    }
    group->Complete();
  };
  lens.Ask<Moves>(move, [exchange, &lens, question, plan](const Result<Moves>& moves) {
    if (!moves) return Refuse(exchange, lens, moves.error());
    const Json applied = MovesJson(lens.name(), *moves);
    lens.watchers().AnnounceMoves(lens, applied);
    const rig::Status& now = lens.status();
    const Metres shift = now.optics ? now.optics->centre_shift() : Metres{0.0};
    const Metres gap = lens.config().rig.scale.principal_gap + shift;
    std::string reply = PlanReply(plan, gap) + ",\"applied\":" + varlink::WriteJson(applied);
    if (const auto reached = CheckNow(now, lens.config().rig, question.asked)) {
      reply += ",\"reached\":" + proto::PlanAnswerText(*reached, gap, proto::PlanShows::Setting);
    }
    exchange->Finish(reply + question.Shown(plan) + "}");
  });
}

void Answer(ServedLens& lens, const ExchangePointer& exchange, const Question& question, const Planning& planning) {
  if (question.asked.stack) {
    const auto stack = StackFor(planning, question.asked, lens.status());
    if (!stack) return Refuse(exchange, stack.error());
    return exchange->Finish(Wrap("plan", varlink::WriteJson(StackReply(*stack))));
  }
  const auto plan = PlanFor(planning, question.asked, lens.status());
  if (!plan) return Refuse(exchange, plan.error());
  if (plan->answer.plan.feasible && question.apply) return Apply(lens, exchange, question, *plan);
  exchange->Finish(PlanReply(*plan, planning.scale.principal_gap + planning.scale.centre_shift) +
                   question.Shown(*plan) + "}");
}

/// With a planning that counts for the lens as it stands.
void PlanNow(ServedLens& lens, const ExchangePointer& exchange) {
  auto asked = proto::LensRequestFromJson(*exchange->view().Find("request"), lens.planning()->defaults);
  if (!asked) return Refuse(exchange, asked.error());
  const Question question{*std::move(asked), Says(exchange, "apply"), Says(exchange, "showRequest")};
  if (!question.asked.focal_lengths && !question.asked.field) {
    return Answer(lens, exchange, question, *lens.planning());
  }
  const auto choose = [&lens, question](rig::Rig& rig, auto done) {
    done(PlanningForZoom(rig, lens.config().rig, question.asked));
  };
  lens.Ask<ZoomedPlanning>(choose, [&lens, exchange, question](const Result<ZoomedPlanning>& zoomed) {
    if (!zoomed) return Refuse(exchange, lens, zoomed.error());
    Question there = question;
    there.asked.plan = zoomed->request;
    Answer(lens, exchange, there, zoomed->planning);
  });
}

void Plan(ServedLens& lens, const ExchangePointer& exchange) {
  if (!lens.planning()) {
    return Refuse(exchange, {Code::Unsupported, "the optics of lens \"" + lens.name() +
                                                    "\" are not known; give it a [lens.optics] section"});
  }
  // Whatever it was planned for last, the lens counts as it stands now.
  if (lens.Outdated()) return lens.Replan([&lens, exchange] { PlanNow(lens, exchange); });
  PlanNow(lens, exchange);
}

}  // namespace

MethodTable PlanMethods(LensService& service) {
  return {{"Plan", service.ForLens(Plan), NeedsLease::ToApply, MayChangeState::Yes}};
}

}  // namespace lensd::daemon
