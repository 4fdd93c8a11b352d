// Move, Home, Stop. The rig decides everything; here its answers find their way back to the caller. A rig's
// callback runs on the worker's thread and hands its reply to Worker::Later(), which the event loop runs.
#include <algorithm>
#include <array>
#include <utility>

#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"
#include "log.h"
#include "move_group.h"
#include "rig/exposure.h"
#include "rig/zoom.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using proto::Json;

/// The definition admits no other names.
Axis AxisOf(const Json& name) {
  return *drivers::AxisFromName(name.get_ref<const std::string&>());
}

struct TargetField {
  std::string_view name;
  rig::Target::Kind kind;
  double scale;  // from the unit in the name to the rig's
};
constexpr std::array kTargetFields = {
    TargetField{"distanceM", rig::Target::Kind::Distance, 1.0},
    TargetField{"vergenceD", rig::Target::Kind::Vergence, 1.0},
    TargetField{"extensionMm", rig::Target::Kind::Extension, 1e-3},
    TargetField{"fNumber", rig::Target::Kind::FNumber, 1.0},
    TargetField{"focalLengthMm", rig::Target::Kind::FocalLength, 1e-3},
    TargetField{"native", rig::Target::Kind::Native, 1.0},
    TargetField{"relative", rig::Target::Kind::NativeRelative, 1.0},
    TargetField{"nearer", rig::Target::Kind::TowardNear, 1.0},
};

Result<std::optional<optics::DistanceFrom>> OriginOf(const Json& parameters) {
  const Json* from = Given(parameters, "distanceFrom");
  if (from == nullptr) return std::nullopt;
  if (*from == "lens") return optics::DistanceFrom::Lens;
  if (*from == "sensor") return optics::DistanceFrom::Sensor;
  if (*from == "front") return optics::DistanceFrom::Front;
  return Fail(Code::InvalidArgument, "distanceFrom is lens, sensor or front");
}

Result<rig::Target> TargetOf(const Json& parameters) {
  std::optional<rig::Target> target;
  for (const TargetField& field : kTargetFields) {
    const Json* value = Given(parameters["target"], field.name);
    if (value == nullptr) continue;
    if (target) return Fail(Code::InvalidArgument, "a target has exactly one field");
    target = rig::Target{field.kind, value->get<double>() * field.scale, std::nullopt};
  }
  if (!target) return Fail(Code::InvalidArgument, "a target has exactly one field");
  auto from = OriginOf(parameters);
  if (!from) return PassOn(std::move(from));
  target->from = *from;
  return *target;
}

/// On the worker's thread: homes one axis, or every axis that has a reference.
void HomeAxes(rig::Rig& rig, std::optional<Axis> only, MoveGroup& group) {
  std::vector<Axis> axes;
  for (const Axis axis : drivers::kAxes) {
    const auto& can = rig.lens().axes[axis];
    if (only ? axis == *only : can && can->can_home) axes.push_back(axis);
  }
  if (axes.empty()) return group.Fail({Code::Unsupported, "no axis of this lens has a reference to search for"});
  for (const Axis axis : axes) rig.Home(axis, group.Add());
  group.Complete();
}

}  // namespace

void LensService::Move(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  const Axis axis = AxisOf(exchange->parameters()["axis"]);
  const Result<rig::Target> target = TargetOf(exchange->parameters());
  if (!target) return Refuse(exchange, target.error());
  if (exchange->call().more) ShowProgress(exchange, *lens, axis);
  const auto asks = [&](const char* key) {
    const Json* flag = Given(exchange->parameters(), key);
    return flag != nullptr && flag->get<bool>();
  };
  if (asks("keepFocus") && axis != Axis::Zoom) {
    return Refuse(exchange, {Code::InvalidArgument, "keepFocus is for the zoom"});
  }
  if (asks("keepBrightness") && axis != Axis::Iris) {
    return Refuse(exchange, {Code::InvalidArgument, "keepBrightness is for the iris"});
  }
  if (asks("keepFocus")) return MoveZoom(exchange, *lens, *target);
  if (asks("keepBrightness")) return MoveIris(exchange, *lens, *target);
  auto answer = [this, exchange, lens](const Result<rig::MoveOutcome>& outcome) {
    Unwatch(exchange.get());
    if (!outcome) return Refuse(exchange, outcome.error());
    const std::string move = proto::WriteJson(MoveJson(lens->name, *outcome));
    exchange->Finish(Wrap("move", move));
    Announce(*lens, "move", move);
  };
  lens->worker->Submit([lens, axis, target = *target, answer](rig::Rig& rig) {
    rig.Move(axis, target, [lens, answer](Result<rig::MoveOutcome> outcome) {
      lens->worker->Later([answer, outcome = std::move(outcome)] { answer(outcome); });
    });
  });
}

void LensService::FinishMove(const ExchangePointer& exchange, const Lens& lens, const Json& move) {
  Unwatch(exchange.get());
  const std::string text = proto::WriteJson(move);
  exchange->Finish(Wrap("move", text));
  Announce(lens, "move", text);
}

void LensService::MoveZoom(const ExchangePointer& exchange, Lens& lens, const rig::Target& target) {
  rig::ZoomRequest request{.target = target, .tolerance = {}};
  if (const Json* um = Given(exchange->parameters(), "trackingToleranceUm")) {
    if (!(um->get<double>() > 0.0)) {
      return Refuse(exchange, {Code::InvalidArgument, "trackingToleranceUm must be above 0"});
    }
    request.tolerance = Metres{um->get<double>() * 1e-6};
  }
  auto answer = [this, exchange, &lens](const Result<rig::ZoomOutcome>& outcome) {
    if (!outcome) {
      Unwatch(exchange.get());
      return Refuse(exchange, outcome.error());
    }
    Json move = MoveJson(lens.name, outcome->zoom);
    move["trackingBoundUm"] = proto::NumberOrNull(outcome->tracking_bound.value * 1e6);
    move["keptD"] = proto::NumberOrNull(outcome->kept.value);
    FinishMove(exchange, lens, move);
  };
  lens.worker->Submit([&lens, request, answer](rig::Rig& rig) {
    rig::ZoomKeepingFocus(rig, request, [&lens, answer](Result<rig::ZoomOutcome> outcome) {
      lens.worker->Later([answer, outcome = std::move(outcome)] { answer(outcome); });
    });
  });
}

void LensService::MoveIris(const ExchangePointer& exchange, Lens& lens, const rig::Target& target) {
  auto answer = [this, exchange, &lens](const Result<rig::BrightMove>& outcome) {
    if (!outcome) {
      Unwatch(exchange.get());
      return Refuse(exchange, outcome.error());
    }
    Json move = MoveJson(lens.name, outcome->move);
    if (outcome->exposure) {
      move["exposureMs"] = std::chrono::duration<double, std::milli>(outcome->exposure->exposure).count();
      move["brightnessRatio"] = proto::NumberOrNull(outcome->exposure->ratio);
    }
    const std::string before = outcome->move.reason;
    move["reason"] = before + (before.empty() || outcome->reason.empty() ? "" : "; ") + outcome->reason;
    FinishMove(exchange, lens, move);
  };
  lens.worker->Submit([&lens, target, factor = lens.config.rig.pupil_factor, answer](rig::Rig& rig) {
    rig::MoveIrisKeepingBrightness(rig, target, factor, [&lens, answer](Result<rig::BrightMove> outcome) {
      lens.worker->Later([answer, outcome = std::move(outcome)] { answer(outcome); });
    });
  });
}

void LensService::ShowProgress(const ExchangePointer& exchange, const Lens& lens, Axis axis) {
  const auto tell = [raw = exchange.get(), axis](const Lens& changed) {
    const auto& status = changed.status->axes[axis];
    if (status && status->moving) raw->Continue(Wrap("progress", proto::WriteJson(MoveProgressJson(axis, *status))));
  };
  Watch({exchange, &lens, tell, false});
}

void LensService::Home(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  const Json* named = Given(exchange->parameters(), "axis");
  const std::optional<Axis> only = named ? std::optional(AxisOf(*named)) : std::nullopt;
  auto group = std::make_shared<MoveGroup>(*lens->worker, lens->name);
  group->OnEnd([this, exchange, lens](const MoveGroup& ended) {
    if (ended.error()) return Refuse(exchange, *ended.error());
    AnnounceMoves(*lens, ended.moves());
    exchange->Finish(Wrap("moves", proto::WriteJson(ended.moves())));
  });
  lens->worker->Submit([only, group](rig::Rig& rig) { HomeAxes(rig, only, *group); });
}

void LensService::HomeAtStart(Lens& lens) {
  auto group = std::make_shared<MoveGroup>(*lens.worker, lens.name);
  group->OnEnd([this, &lens](const MoveGroup& ended) {
    if (ended.error())
      return Log(Severity::Warning, Event::LensLost, "not homed: " + ended.error()->message, lens.name);
    AnnounceMoves(lens, ended.moves());
    for (const rig::MoveOutcome& outcome : ended.outcomes()) {
      if (!outcome.reached) Log(Severity::Warning, Event::LensLost, "not homed: " + outcome.reason, lens.name);
    }
  });
  lens.worker->Submit([group](rig::Rig& rig) { HomeAxes(rig, std::nullopt, *group); });
}

void LensService::ResetFaults(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  std::vector<Axis> axes;
  if (const Json* named = Given(exchange->parameters(), "axis")) axes.push_back(AxisOf(*named));
  auto answer = [this, exchange](const Result<void>& reset) {
    if (!reset) return Refuse(exchange, reset.error());
    exchange->Finish("{}");
  };
  lens->worker->Submit([lens, axes, answer](rig::Rig& rig) {
    rig.ResetFaults(axes, [lens, answer](Result<void> reset) {
      lens->worker->Later([answer, reset = std::move(reset)] { answer(reset); });
    });
  });
}

void LensService::Stop(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  std::vector<Axis> axes;
  if (const Json* named = Given(exchange->parameters(), "axis")) axes.push_back(AxisOf(*named));
  auto answer = [this, exchange](const Result<void>& stopped) {
    if (!stopped) return Refuse(exchange, stopped.error());
    exchange->Finish("{}");
  };
  lens->worker->Submit([lens, axes, answer](rig::Rig& rig) {
    rig.Stop(axes, [lens, answer](Result<void> stopped) {
      lens->worker->Later([answer, stopped = std::move(stopped)] { answer(stopped); });
    });
  });
}

}  // namespace lensd::daemon
