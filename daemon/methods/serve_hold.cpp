// Hold and Release: a client that exposes keeps lensd's own corrections waiting.
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr Duration kLongestHold = std::chrono::hours(1);
/// Keys of what a connection leaves behind when it closes: leases have the highest bit alone.
constexpr std::uint64_t kHoldKeys = std::uint64_t{3} << 62;

std::uint64_t HoldKeyOf(const ServedLens& lens) {
  return kHoldKeys | (std::hash<std::string>()(lens.name()) >> 2);
}

/// Tells the rig until when holds last now, and `then` whether it is at rest.
void ApplyHolds(ServedLens& lens, std::function<void(const Result<bool>&)> then) {
  const auto hold = [until = lens.users().holds.last()](rig::Rig& rig, auto done) { done(rig.Hold(until)); };
  lens.Ask<bool>(hold, std::move(then));
}

/// The connection has closed, or wants no more.
void EndHold(ServedLens& lens, const void* owner, std::function<void(const Result<bool>&)> then) {
  lens.users().holds.Drop(owner);
  ApplyHolds(lens, std::move(then));
}

void Hold(LensService& service, const ExchangePointer& exchange) {
  ServedLens* const found = service.FindPresent(exchange);
  if (found == nullptr) return;
  ServedLens& lens = *found;
  const Instant now = service.clock().Now();
  const Instant until{Duration(exchange->parameters()["untilNs"].get<std::int64_t>())};
  if (until <= now || until - now > kLongestHold) {
    const auto ns = [](Instant at) { return static_cast<double>(at.time_since_epoch().count()); };
    return Refuse(exchange, lens,
                  Wrong("untilNs is an instant to come on CLOCK_MONOTONIC, an hour from now at most",
                        {.parameter = "untilNs", .minimum = ns(now), .maximum = ns(now + kLongestHold), .unit = "ns"}));
  }
  if (exchange->peer() == nullptr) {
    return Refuse(exchange, lens,
                  {Code::InvalidArgument, "a hold lasts as long as its connection: a oneway call has none to wait on"});
  }
  const void* const owner = exchange->client();
  // By name: a lens that is opened anew by another configuration has no hold.
  exchange->AtClose(HoldKeyOf(lens), [&service, name = lens.name(), owner] {
    const auto here = std::ranges::find(service.lenses(), name, &ServedLens::name);
    if (here != service.lenses().end()) EndHold(**here, owner, [](const Result<bool>&) {});
  });
  lens.users().holds.Put(owner, until);
  ApplyHolds(lens, [&service, &lens, exchange, until, owner](const Result<bool>& at_rest) {
    if (!at_rest) {
      lens.users().holds.Drop(owner);
      return Refuse(exchange, lens, at_rest.error());
    }
    const std::string held = varlink::WriteJson({{"untilNs", until.time_since_epoch().count()}, {"atRest", *at_rest}});
    if (!exchange->call().more) return exchange->Finish(held);
    exchange->Continue(held);
    const auto waiting = std::make_shared<ExchangePointer>(exchange);
    exchange->OnGone([waiting] { waiting->reset(); });
    service.loop().After(until - service.clock().Now(), [waiting, held] {
      if (const auto call = std::exchange(*waiting, nullptr)) call->Finish(held);
    });
  });
}

void Release(ServedLens& lens, const ExchangePointer& exchange) {
  exchange->AtClose(HoldKeyOf(lens), {});
  EndHold(lens, exchange->client(), [&lens, exchange](const Result<bool>& done) {
    if (!done) return Refuse(exchange, lens, done.error());
    exchange->Finish("{}");
  });
}

}  // namespace

MethodTable HoldMethods(LensService& service) {
  return {{"Hold", service.ForPresent([&service](const ExchangePointer& exchange) { Hold(service, exchange); })},
          {"Release", service.ForLens(Release)}};
}

}  // namespace lensd::daemon
