// Move, Home, Stop, ResetFaults. The rig decides everything; here its answers find their way back to the caller.
#include <algorithm>
#include <array>
#include <utility>

#include "daemon/lens/move_group.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/target_json.h"
#include "rig/exposure.h"
#include "rig/zoom.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using varlink::Json;

/// The definition admits no other names.
Axis AxisOf(const Json& name) {
  return *drivers::AxisFromName(name.get_ref<const std::string&>());
}

/// Of a call; nothing: all of them.
std::vector<Axis> AxesOf(const ExchangePointer& exchange) {
  const Json* named = Given(exchange->parameters(), "axis");
  return named == nullptr ? std::vector<Axis>{} : std::vector{AxisOf(*named)};
}

void ShowProgress(const ServedLens& lens, const ExchangePointer& exchange, Axis axis) {
  const auto tell = [axis](const ServedLens& changed) -> std::optional<std::string> {
    const auto& status = changed.status().axes[axis];
    if (!status || !status->moving) return std::nullopt;
    return Wrap("progress", varlink::WriteJson(MoveProgressJson(axis, *status)));
  };
  lens.watchers().Add({exchange, &lens, tell});
}

/// The end of a move: nothing is said of its progress after it.
void FinishMove(const ServedLens& lens, const ExchangePointer& exchange, const Result<Json>& move) {
  lens.watchers().Remove(exchange);
  if (!move) {
    const bool about_target = move.error().code == Code::OutOfRange || move.error().code == Code::InvalidArgument;
    return Refuse(
        exchange, lens,
        about_target ? About(TargetPath("target", exchange->parameters()["target"]), move.error()) : move.error());
  }
  exchange->Finish(Wrap("move", varlink::WriteJson(*move)));
  lens.watchers().Announce(lens, "move", *move);
}

/// Has the rig carry out `command`; `json` makes a MoveResult of its outcome.
template <class Outcome, class Command, class ToJson>
void Carry(ServedLens& lens, const ExchangePointer& exchange, Command command, ToJson json) {
  lens.Ask<Outcome>(std::move(command), [&lens, exchange, json](const Result<Outcome>& outcome) {
    FinishMove(lens, exchange, outcome ? Result<Json>(json(*outcome)) : PassOn(outcome));
  });
}

void MoveZoom(ServedLens& lens, const ExchangePointer& exchange, const rig::Target& target) {
  rig::ZoomRequest request{.target = target, .tolerance = {}};
  if (const Json* um = Given(exchange->parameters(), "trackingToleranceUm"))
    request.tolerance = Metres{um->get<double>() * 1e-6};
  const auto zoom = [request](rig::Rig& rig, auto done) { rig::ZoomKeepingFocus(rig, request, std::move(done)); };
  Carry<rig::ZoomOutcome>(lens, exchange, zoom, [&lens](const rig::ZoomOutcome& outcome) {
    Json move = MoveJson(lens.name(), outcome.zoom);
    move["trackingBoundUm"] = varlink::NumberOrNull(outcome.tracking_bound.value * 1e6);
    move["keptD"] = varlink::NumberOrNull(outcome.kept.value);
    return move;
  });
}

void MoveIris(ServedLens& lens, const ExchangePointer& exchange, const rig::Target& target) {
  const auto iris = [target, factor = lens.config().rig.pupil_factor](rig::Rig& rig, auto done) {
    rig::MoveIrisKeepingBrightness(rig, target, factor, std::move(done));
  };
  Carry<rig::BrightMove>(lens, exchange, iris, [&lens](const rig::BrightMove& outcome) {
    Json move = MoveJson(lens.name(), outcome.move);
    if (outcome.exposure) {
      move["exposureMs"] = std::chrono::duration<double, std::milli>(outcome.exposure->exposure).count();
      move["brightnessRatio"] = varlink::NumberOrNull(outcome.exposure->ratio);
    }
    const std::string before = outcome.move.reason;
    if (!outcome.reason.empty()) move["cause"] = "exposure";
    move["reason"] = TextOrNull(before + (before.empty() || outcome.reason.empty() ? "" : "; ") + outcome.reason);
    return move;
  });
}

/// Why the call makes no sense; nothing: it does.
std::optional<Error> WhyNot(const ExchangePointer& exchange, Axis axis) {
  if (exchange->Asks("keepFocus") && axis != Axis::Zoom) {
    return Wrong("keepFocus is for the zoom", {.parameter = "keepFocus"});
  }
  if (exchange->Asks("keepBrightness") && axis != Axis::Iris) {
    return Wrong("keepBrightness is for the iris", {.parameter = "keepBrightness"});
  }
  const Json* um = Given(exchange->parameters(), "trackingToleranceUm");
  if (um != nullptr && !(um->get<double>() > 0.0)) {
    return Wrong("trackingToleranceUm must be above 0", {.parameter = "trackingToleranceUm"});
  }
  return std::nullopt;
}

void Move(ServedLens& lens, const ExchangePointer& exchange) {
  const Axis axis = AxisOf(exchange->parameters()["axis"]);
  const Result<rig::Target> target =
      TargetOf(exchange->parameters()["target"], OriginOf(exchange->parameters()), "target");
  if (!target) return Refuse(exchange, lens, target.error());
  if (const auto why = WhyNot(exchange, axis)) return Refuse(exchange, lens, *why);
  if (exchange->call().more) ShowProgress(lens, exchange, axis);
  if (exchange->Asks("keepFocus")) return MoveZoom(lens, exchange, *target);
  if (exchange->Asks("keepBrightness")) return MoveIris(lens, exchange, *target);
  const auto move = [axis, target = *target](rig::Rig& rig, auto done) {
    const auto now = rig.GetStatus().axes[axis];
    const bool nowhere = now && now->lost && target.kind == rig::Target::Kind::Native;
    rig.Move(axis, target, [nowhere, done = std::move(done)](Result<rig::MoveOutcome> moved) mutable {
      if (moved && nowhere) moved->reached = false;  // it went by its count, which says nothing of the place asked for
      done(std::move(moved));
    });
  };
  Carry<rig::MoveOutcome>(lens, exchange, move,
                          [&lens](const rig::MoveOutcome& outcome) { return MoveJson(lens.name(), outcome); });
}

void Home(ServedLens& lens, const ExchangePointer& exchange) {
  const std::vector<Axis> axes = AxesOf(exchange);
  const auto only = axes.empty() ? std::nullopt : std::optional(axes.front());
  const auto home = [only](rig::Rig& rig, MovesCallback done) { HomeAxes(rig, only, std::move(done)); };
  lens.Ask<Moves>(home, [&lens, exchange](const Result<Moves>& moves) {
    if (!moves) return Refuse(exchange, lens, moves.error());
    const Json json = MovesJson(lens.name(), *moves);
    lens.watchers().AnnounceMoves(lens, json);
    exchange->Finish(Wrap("moves", varlink::WriteJson(json)));
  });
}

/// Answers a call that has nothing to say but that it is done.
auto Acknowledge(const ServedLens& lens, const ExchangePointer& exchange) {
  return [&lens, exchange](const Result<void>& done) {
    if (!done) return Refuse(exchange, lens, done.error());
    exchange->Finish("{}");
  };
}

void SetPosition(ServedLens& lens, const ExchangePointer& exchange) {
  const Axis axis = AxisOf(exchange->parameters()["axis"]);
  const Native position{exchange->parameters()["position"].get<double>()};
  const auto say = [axis, position](rig::Rig& rig, auto done) { rig.SetPosition(axis, position, std::move(done)); };
  lens.users().stay->Saying();
  lens.Ask<void>(say, [&lens, axis, answer = Acknowledge(lens, exchange)](const Result<void>& said) {
    if (said) lens.users().history.Clear();
    lens.users().stay->Said(axis, said.has_value());
    answer(said);
  });
}

void ResetFaults(ServedLens& lens, const ExchangePointer& exchange) {
  lens.users().stops.Unlatch();
  const auto reset = [axes = AxesOf(exchange)](rig::Rig& rig, auto done) { rig.ResetFaults(axes, std::move(done)); };
  lens.Ask<void>(reset, Acknowledge(lens, exchange));
}

/// What the lenses that are to be stopped have answered.
struct StopAnswers {
  struct Failure {
    const ServedLens& lens;
    Error error;
  };
  ExchangePointer exchange;
  std::size_t outstanding = 0;
  std::optional<Failure> first;

  void Take(const ServedLens& lens, const Result<void>& stopped) {
    if (!stopped && !first) first.emplace(lens, stopped.error());
    CountDown();
  }
  void CountDown() {
    if (--outstanding > 0) return;
    if (first) return Refuse(exchange, first->lens, first->error);
    exchange->Finish("{}");
  }
};

/// The lens it names, or every one that is there. Acts on what was read before it, also where that has not begun.
void Stop(LensService& service, const ExchangePointer& exchange) {
  std::vector<ServedLens*> lenses;
  if (exchange->view().Given("lens")) {
    ServedLens* const lens = service.FindPresent(exchange, ServedLens::For::Stop);
    if (lens == nullptr) return;
    lenses.push_back(lens);
  } else {
    for (const auto& lens : service.lenses()) lenses.push_back(lens.get());
  }
  const std::vector<Axis> axes = AxesOf(exchange);
  const bool all = !exchange->view().Given("lens").has_value();
  const auto answers = std::make_shared<StopAnswers>(StopAnswers{exchange, 1, std::nullopt});
  for (ServedLens* lens : lenses) {
    lens->users().stops.Note(exchange->number(), axes, exchange->Asks("latch"));
    if (const auto why = lens->WhyAbsent(ServedLens::For::Stop)) {
      // Of all, those that are there; but where calls hang it cannot be said that nothing runs.
      if (lens->stuck() > 0 && !answers->first) answers->first.emplace(*lens, *why);
      continue;
    }
    ++answers->outstanding;
    const auto stop = [axes, all, latch = exchange->Asks("latch")](rig::Rig& rig, auto done) {
      // Of every lens only those that have such an axis are meant.
      const bool has = axes.empty() || rig.lens().axes[axes.front()];
      if (all && !has) return done(Result<void>());
      // No axis moves from then on, not even back from a search's conditions.
      rig.Stop(latch ? std::vector<Axis>{} : axes, std::move(done));
    };
    lens->AskToStop<void>(stop, [answers, lens](const Result<void>& stopped) { answers->Take(*lens, stopped); });
  }
  answers->CountDown();
}

}  // namespace

MethodTable MotionMethods(LensService& service) {
  return {{"Move", service.ForLens(Move)},
          {"Home", service.ForLens(Home)},
          {"SetPosition", service.ForLens(SetPosition)},
          {"Stop", [&service](const ExchangePointer& exchange) { Stop(service, exchange); }, Acts::WhenRead},
          {"ResetFaults", service.ForLens(ResetFaults)}};
}

}  // namespace lensd::daemon
