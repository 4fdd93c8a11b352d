// GetLearned and ForgetLearned: what autofocus has taught lensd of a lens.
#include <optional>
#include <utility>

#include "lens_json.h"
#include "lens_service.h"
#include "lens_slope.h"
#include "serve.h"

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

}  // namespace

MethodTable LearnedMethods(LensService& service) {
  return {{"GetLearned", service.ForLens(GetLearned)},
          {"ForgetLearned", service.ForLens(ForgetLearned), NeedsLease::ToChange, MayChangeState::Yes}};
}

}  // namespace lensd::daemon
