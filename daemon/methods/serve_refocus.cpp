// GetRefocus and ForgetDrift: what lensd does by itself to keep a lens in focus, and what it has learned for that.
#include <utility>

#include "daemon/lens/refocus.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

void GetRefocus(ServedLens& lens, const ExchangePointer& exchange) {
  exchange->Finish(varlink::WriteJson({{"refocus", lens.users().refocus->StateJson()}}));
}

void ForgetDrift(ServedLens& lens, const ExchangePointer& exchange) {
  std::optional<std::int64_t> which;
  if (const Json* number = Given(exchange->parameters(), "result")) which = number->get<std::int64_t>();
  lens.users().refocus->Forget(which, [&lens, exchange](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish("{}");
  });
}

}  // namespace

MethodTable RefocusMethods(LensService& service) {
  return {{"GetRefocus", service.ForLens(GetRefocus)}, {"ForgetDrift", service.ForLens(ForgetDrift)}};
}

}  // namespace lensd::daemon
