// Reload: reads the configuration again and tells what became of the lenses.
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"

namespace lensd::daemon {
namespace {

void Reload(LensService& service, const ExchangePointer& exchange) {
  if (!service.reload()) return Refuse(exchange, {Code::Unsupported, "lensd was started without a configuration"});
  service.reload()([exchange](const Result<LensService::Replaced>& replaced) {
    if (!replaced && (replaced.error().code == Code::BadData || replaced.error().code == Code::Io)) {
      return exchange->Refuse("io.lensd.Lens.BadConfiguration", {{"message", replaced.error().message}});
    }
    if (!replaced) return Refuse(exchange, replaced.error());
    const varlink::Json reply = {{"added", replaced->added},
                                 {"removed", replaced->removed},
                                 {"reopened", replaced->reopened},
                                 {"unchanged", replaced->unchanged}};
    exchange->Finish(varlink::WriteJson(reply));
  });
}

}  // namespace

MethodTable ReloadMethods(LensService& service) {
  return {{"Reload", [&service](const ExchangePointer& exchange) { Reload(service, exchange); }}};
}

}  // namespace lensd::daemon
