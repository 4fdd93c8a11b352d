// Plan: what takes microseconds is solved here and now, in the event loop; what may take longer on a thread of its own,
// so that no stop waits for it. Only applying a plan involves the worker.
#include <algorithm>
#include <utility>

#include "base/guarded.h"
#include "base/missing_optics.h"
#include "daemon/lens/move_group.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"
#include "planning/plan_causes.h"
#include "planning/request_fault.h"
#include "planning/zoom_choice.h"
#include "proto/plan_json.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using varlink::Json;

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
  const auto& [request, answer] = std::tie(plan.answer.request, plan.answer.plan);
  if (answer.feasible) {
    return "{\"plan\":" + With(proto::PlanAnswerText(request, answer, principal_gap), Places(plan));
  }
  if (!plan.answer.continuous_feasible) return "{\"plan\":" + proto::PlanAnswerText(request, answer, principal_gap);
  optics::PlanAnswer refusal = answer;  // limits so much wider are met by the nearest position itself
  refusal.conflict = {"positions"};
  refusal.relax = answer.worst_ratio;
  refusal.note = "some setting meets every limit, but none of the positions this lens can take does; see the nearest";
  return "{\"plan\":" + proto::PlanAnswerText(request, refusal, principal_gap) + ",\"nearest\":" +
         With(proto::PlanAnswerText(request, answer, principal_gap, proto::PlanShows::Setting), Places(plan));
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
    if (!stack.field_widths.empty()) shots.back()["fieldWidthM"] = stack.field_widths[i].value;
  }
  Json reply{{"feasible", true}, {"shots", std::move(shots)}};
  if (!stack.field_widths.empty()) {
    reply["focalLengthMm"] = reply["shots"][0]["focalLengthMm"];
    reply["fieldWidthM"] = reply["shots"][0]["fieldWidthM"];
  }
  return reply;
}

struct Question {
  proto::LensRequest asked;
  bool shows_request = false;

  std::string Shown(const LensPlan& plan) const {
    if (!shows_request) return "";
    return ",\"request\":" + varlink::WriteJson(proto::PlanRequestJson(plan.answer.request));
  }
};

/// What a call came to: a reply, a plan to be carried out first, or a refusal to find the causes of.
struct Solved {
  std::string reply;
  std::optional<LensPlan> apply, refused;
  Question question{};                         ///< of `apply` and `refused`
  std::shared_ptr<const Planning> planning{};  ///< of `refused`
};

/// What solving takes; of one moment, so that it may be done on any thread.
struct Problem {
  varlink::JsonView request;  ///< lives as long as the exchange
  bool apply = false;
  bool shows_request = false;
  std::shared_ptr<const Planning> planning;
  std::shared_ptr<const rig::Status> now;
  const rig::RigConfig& config;
  const std::string& lens;  ///< its name
  std::stop_token stop;     ///< lensd ends
};

/// The whole reply to a plan that is not carried out.
std::string ReplyTo(const LensPlan& plan, const Planning& planning, const Question& question) {
  const Metres gap = planning.scale.principal_gap + planning.scale.centre_shift;
  return PlanReply(plan, gap) + question.Shown(plan) + "}";
}

Result<Solved> SolveWith(std::shared_ptr<const Planning> held, const Problem& problem, Question question) {
  const Planning& planning = *held;
  if (auto empty = EmptyRange(question.asked, problem.request, planning.defaults)) return PassOn(*std::move(empty));
  if ((problem.apply || question.asked.stack) && rig::LacksDirection(*planning.lens.optics)) {
    return PassOn(rig::DirectionUnknown("a plan cannot be carried out"));
  }
  if (question.asked.stack) {
    const auto stack = StackFor(planning, question.asked, *problem.now);
    if (!stack) return PassOn(stack);
    return Solved{Wrap("plan", varlink::WriteJson(StackReply(*stack))), std::nullopt, std::nullopt};
  }
  auto plan = PlanFor(planning, question.asked, *problem.now);
  if (!plan) return PassOn(WithReach(plan.error(), question.asked, planning));
  if (!plan->answer.plan.feasible)
    return Solved{"", std::nullopt, *std::move(plan), std::move(question), std::move(held)};
  if (problem.apply) return Solved{"", *std::move(plan), std::nullopt, std::move(question)};
  return Solved{ReplyTo(*plan, planning, question), std::nullopt, std::nullopt};
}

Result<Solved> Solve(const Problem& problem) {
  auto asked = proto::LensRequestFromJson(problem.request, problem.planning->defaults);
  if (!asked) return PassOn(asked);
  Question question{*std::move(asked), problem.shows_request};
  if (!question.asked.focal_lengths && !question.asked.field) {
    return SolveWith(problem.planning, problem, std::move(question));
  }
  auto zoomed = PlanningForZoom(problem.planning->lens, problem.config, question.asked, *problem.now, problem.stop);
  if (!zoomed) return PassOn(zoomed);
  question.asked.plan = std::move(zoomed->request);
  return SolveWith(std::make_shared<const Planning>(std::move(zoomed->planning)), problem, std::move(question));
}

/// Whether a call may take longer than the event loop can spare, a millisecond.
bool MayTakeLong(const ExchangePointer& exchange) {
  constexpr std::size_t kFewLimits = 4096;  // bytes: some forty limits
  constexpr std::string_view kLaborious[] = {"focalLengthMm", "focalLengthMinMm", "focalLengthMaxMm", "field",
                                             "stack",         "wavelengthNm"};
  if (exchange->call().bytes > kFewLimits) return true;
  const auto request = exchange->view().Find("request");
  return std::ranges::any_of(kLaborious, [&](std::string_view field) { return request->Given(field).has_value(); });
}

/// Runs `work` on the thread of plans, then in the event loop what it returns. False: too many wait there.
bool ComputeElsewhere(ServedLens& lens, const ExchangePointer& exchange, std::move_only_function<Task()> work) {
  return lens.surroundings().plans.Submit(
      [&lens, exchange = ExchangePointer(exchange), work = std::move(work)]() mutable {
        Task then;
        if (const auto thrown = Guarded(lens.name(), [&] { then = work(); })) {
          then = [&lens, exchange, error = *thrown] { Refuse(exchange, lens, error); };
        }
        // Whatever holds the call is let go of where calls live: nothing of it stays on this thread.
        lens.surroundings().loop.Post(
            [then = std::move(then), work = std::move(work), held = std::move(exchange)]() mutable { then(); });
      });
}

/// Runs `work` at once where it is short, else on the thread of plans.
void Compute(ServedLens& lens, const ExchangePointer& exchange, std::move_only_function<Task()> work) {
  if (!MayTakeLong(exchange)) return work()();
  if (!ComputeElsewhere(lens, exchange, std::move(work))) {
    Refuse(exchange, lens, {Code::Busy, "too many plans wait to be solved; try again"});
  }
}

/// The reply of a plan that was carried out.
std::string AppliedReply(const Solved& solved, const std::string& applied, const rig::Status& now,
                         const rig::RigConfig& config) {
  const Metres shift = now.optics ? now.optics->centre_shift() : Metres{0.0};
  const Metres gap = config.scale.principal_gap + shift;
  std::string reply = PlanReply(*solved.apply, gap) + ",\"applied\":" + applied;
  if (const auto reached = CheckNow(now, config, solved.question.asked)) {
    reply +=
        ",\"reached\":" + proto::PlanAnswerText(solved.apply->answer.request, *reached, gap, proto::PlanShows::Setting);
  }
  return reply + solved.question.Shown(*solved.apply) + "}";
}

void Apply(ServedLens& lens, const ExchangePointer& exchange, Solved solved) {
  if (auto why = lens.users().stops.WhyStopped(exchange->number(), std::nullopt)) return Refuse(exchange, lens, *why);
  const auto move = [focus = solved.apply->focus, iris = solved.apply->iris, zoom = solved.apply->zoom](
                        rig::Rig& rig, MovesCallback done) {
    const rig::Status now = rig.GetStatus();
    for (const Axis axis : drivers::kAxes) {
      if (auto lost = rig::WhyLost(axis, now.axes[axis])) return done(PassOn(*std::move(lost)));
    }
    const auto group = std::make_shared<MoveGroup>(std::move(done));
    for (const auto& [axis, place] :
         {std::pair(Axis::Zoom, zoom), std::pair(Axis::Focus, focus), std::pair(Axis::Iris, iris)}) {
      if (place) rig.Move(axis, {rig::Target::Kind::Native, place->value, std::nullopt}, group->Add());
    }
    group->Complete();
  };
  lens.Ask<Moves>(move, [exchange, &lens, solved = std::move(solved)](const Result<Moves>& moves) mutable {
    if (!moves) return Refuse(exchange, lens, moves.error());
    const Json applied = MovesJson(lens.name(), *moves);
    lens.watchers().AnnounceMoves(lens, applied);
    Compute(lens, exchange,
            [exchange, solved = std::move(solved), applied = varlink::WriteJson(applied), now = lens.shared_status(),
             &config = lens.config().rig]() -> Task {
              return [exchange, reply = AppliedReply(solved, applied, *now, config)] { exchange->Finish(reply); };
            });
  });
}

/// A refusal names its causes. Where too many plans wait to be solved it goes out without them.
void FinishRefused(ServedLens& lens, const ExchangePointer& exchange, const Problem& problem, Solved solved) {
  const auto held = std::make_shared<Solved>(std::move(solved));
  const auto find = [exchange, problem, held]() -> Task {
    LensPlan& plan = *held->refused;
    plan.answer.plan.causes = CausesOf({.planning = *held->planning,
                                        .asked = held->question.asked,
                                        .now = *problem.now,
                                        .config = problem.config,
                                        .answer = plan.answer,
                                        .lens = problem.lens},
                                       problem.stop);
    return [exchange, reply = ReplyTo(plan, *held->planning, held->question)] { exchange->Finish(reply); };
  };
  if (ComputeElsewhere(lens, exchange, find)) return;
  exchange->Finish(ReplyTo(*held->refused, *held->planning, held->question));
}

/// With a planning that counts for the lens as it stands.
void PlanNow(ServedLens& lens, const ExchangePointer& exchange) {
  const Problem problem{.request = *exchange->view().Find("request"),
                        .apply = exchange->Asks("apply"),
                        .shows_request = exchange->Asks("showRequest"),
                        .planning = lens.planning(),
                        .now = lens.shared_status(),
                        .config = lens.config().rig,
                        .lens = lens.name(),
                        .stop = lens.surroundings().plans.stop()};
  Compute(lens, exchange, [&lens, exchange, problem]() -> Task {
    auto solved = Solve(problem);
    if (!solved) solved = PassOn(AsAsked(solved.error(), problem.request));
    return [&lens, exchange, problem, solved = std::move(solved)]() mutable {
      if (!solved) return Refuse(exchange, lens, solved.error());
      if (solved->refused) return FinishRefused(lens, exchange, problem, *std::move(solved));
      if (solved->apply) return Apply(lens, exchange, *std::move(solved));
      exchange->Finish(solved->reply);
    };
  });
}

void Plan(ServedLens& lens, const ExchangePointer& exchange) {
  if (!lens.planning()) {
    return Refuse(exchange, lens, {Code::Unsupported, OpticsMissing("the optics of lens \"" + lens.name() + "\" are")});
  }
  // Whatever it was planned for last, the lens counts as it stands now.
  if (!lens.Outdated()) return PlanNow(lens, exchange);
  lens.Replan([&lens, exchange](const Result<void>& replanned) {
    replanned ? PlanNow(lens, exchange) : Refuse(exchange, lens, replanned.error());
  });
}

}  // namespace

MethodTable PlanMethods(LensService& service) {
  return {{"Plan", service.ForLens(Plan)}};
}

}  // namespace lensd::daemon
