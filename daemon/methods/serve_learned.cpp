// GetLearned, ForgetLearned and KeepDirection: what autofocus and setup have taught lensd of a lens.
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "daemon/lens/lens_slope.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/state/lens_state_files.h"
#include "daemon/state/state_file.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using varlink::Json;

/// What a search with the lens' own camera would begin under; nothing: an axis is not homed.
struct SlopeNow {
  std::optional<rig::SlopeConditions> under;
  std::shared_ptr<const rig::OpticsTable> optics;
};

SlopeNow SlopeNowOf(const rig::Rig& rig) {
  const rig::Status status = rig.GetStatus();
  rig::SlopeConditions under;
  under.pixel_um = rig.camera() != nullptr ? rig.camera()->pixel_um : 0.0;
  for (const auto& [axis, place] : {std::pair(Axis::Iris, &under.iris), std::pair(Axis::Zoom, &under.zoom)}) {
    const auto& motor = status.axes[axis];
    if (!motor) continue;
    if (!motor->homed) return {.under = {}, .optics = status.optics};
    *place = motor->position;
  }
  return {.under = under, .optics = status.optics};
}

void GetLearned(ServedLens& lens, const ExchangePointer& exchange) {
  lens.Ask<SlopeNow>([](rig::Rig& rig, auto done) { done(SlopeNowOf(rig)); },
                     [&lens, exchange](const Result<SlopeNow>& now) {
                       if (!now) return Refuse(exchange, lens, now.error());
                       exchange->Finish(varlink::WriteJson(
                           {{"learned", lens.users().slope->StateJson(now->under, now->optics.get())}}));
                     });
}

void ForgetLearned(ServedLens& lens, const ExchangePointer& exchange) {
  lens.users().slope->Forget([&lens, exchange](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish("{}");
  });
}

/// What was seen is in force from now on, and kept.
void Keep(ServedLens& lens, std::optional<drivers::Direction> seen, std::function<void(const Result<void>&)> done) {
  const auto command = [seen](rig::Rig& rig, auto answer) {
    const std::string serial = rig.lens().serial;
    rig.SetSeenDirection(seen, [serial, answer = std::move(answer)](Result<void> set) mutable {
      answer(set ? Result<std::string>(serial) : Result<std::string>(PassOn(set)));
    });
  };
  lens.Ask<std::string>(command, [&lens, seen, done = std::move(done)](const Result<std::string>& serial) {
    if (!serial) return done(PassOn(serial));
    lens.users().direction.Put(*serial, seen);
    KeepStateFile(
        lens, DirectionFile(lens.config(), lens.surroundings().state, *serial),
        seen ? rig::SeenDirectionText(*seen, StateFileMoment()) : "", "the direction of focus",
        [&lens, done](const Result<void>& kept) { lens.Replan([done, kept](const Result<void>&) { done(kept); }); });
  });
}

void KeepDirection(ServedLens& lens, const ExchangePointer& exchange) {
  std::optional<drivers::Direction> seen;
  if (const Json* named = Given(exchange->parameters(), "direction")) {
    using drivers::Direction;
    const bool positive = *named == FocusDirectionName(Direction::NearPositive);
    seen = positive ? Direction::NearPositive : Direction::NearNegative;
  }
  Keep(lens, seen, [&lens, exchange](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish("{}");
  });
}

}  // namespace

MethodTable LearnedMethods(LensService& service) {
  return {{"GetLearned", service.ForLens(GetLearned)},
          {"ForgetLearned", service.ForLens(ForgetLearned)},
          {"KeepDirection", service.ForLens(KeepDirection)}};
}

}  // namespace lensd::daemon
