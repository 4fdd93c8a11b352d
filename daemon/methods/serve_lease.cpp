// TakeLease, DropLease, and whom a lease keeps from moving a lens.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/server/random_name.h"
#include "daemon/wire/lens_json.h"
#include "proto/errors_and_methods.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr double kLongestLeaseMs = 24.0 * 3600.0 * 1e3;
/// Keys of what a connection leaves behind when it closes: sessions count from 1, leases from here.
constexpr std::uint64_t kLeaseKeys = std::uint64_t{1} << 63;

/// Whether a call of a method may move a lens, so that a stop stands against it, and another client's lease.
bool Drives(const Method& method, const ExchangePointer& exchange) {
  return method.needs_lease == NeedsLease::Yes ||
         (method.needs_lease == NeedsLease::ToApply && exchange->Asks("apply"));
}

/// The connection that took the lease, or one that gives its key.
bool Holds(const Lease& lease, const ExchangePointer& exchange) {
  const auto key = exchange->view().Given("lease");
  return (lease.owner != nullptr && lease.owner == exchange->client()) || (key && key->text() == lease.key);
}

/// Ends a call that another client's lease stands against: who has it, and for how long.
void RefuseLeased(LensService& service, const ExchangePointer& exchange, const ServedLens& lens,
                  const std::string& what_then) {
  const Lease& lease = *lens.users().lease.now();
  Json remaining = nullptr;
  std::string how_long = "until it lets go";
  if (lease.until) {
    const double ms = std::chrono::duration<double, std::milli>(*lease.until - service.clock().Now()).count();
    remaining = ms;
    how_long = "for another " + std::to_string(std::lround(std::ceil(1e-3 * ms))) + " s";
  }
  exchange->Refuse(
      proto::ErrorOf(Code::Leased).name,
      {{"message", "lens \"" + lens.name() + "\" is leased to " + lease.holder + " " + how_long + "; " + what_then},
       {"lens", lens.name()},
       {"holder", lease.holder},
       {"remainingMs", remaining}});
}

/// What another client's call does with the lens and a new lease would break into; empty: nothing. Single moves come to
/// their end by themselves.
std::string WhatGoesOn(const ServedLens& lens, const ExchangePointer& exchange) {
  if (!lens.users().driving.ButOf(exchange->client())) return "";
  switch (lens.status().activity.kind) {
    case rig::Activity::Kind::Autofocus:
      return "autofocus";
    case rig::Activity::Kind::Backlash:
      return "backlash";
    default:
      return "";
  }
}

/// Ends what goes on; calls that wait for it are answered Cancelled.
void StopAll(ServedLens& lens, const ExchangePointer& exchange) {
  lens.users().stops.Note(exchange->number(), {}, false);
  lens.AskToStop<void>([](rig::Rig& rig, auto done) { rig.Stop({}, std::move(done)); }, [](const Result<void>&) {});
}

void TakeLease(LensService& service, const ExchangePointer& exchange) {
  ServedLens* const lens = service.Find(exchange);
  if (lens == nullptr) return;
  const Json* for_ms = Given(exchange->parameters(), "forMs");
  if (for_ms != nullptr && !(for_ms->get<double>() > 0.0 && for_ms->get<double>() <= kLongestLeaseMs)) {
    return Refuse(
        exchange, *lens,
        Wrong("forMs is above 0 and at most a day", {.parameter = "forMs", .maximum = kLongestLeaseMs, .unit = "ms"}));
  }
  if (exchange->peer() == nullptr) {
    return Refuse(exchange, *lens,
                  {Code::InvalidArgument, "a lease has an answer: it cannot be taken by a oneway call"});
  }
  const Lease* const before = lens->users().lease.now();
  const bool holds = before != nullptr && Holds(*before, exchange);
  if (before != nullptr && !holds && !exchange->Asks("takeOver")) {
    return RefuseLeased(service, exchange, *lens, "it can be taken then, and by administrators at any time (takeOver)");
  }
  if (const std::string activity = WhatGoesOn(*lens, exchange); !activity.empty()) {
    if (!exchange->Asks("stop")) {
      const std::string why = "another client's " + activity + " is under way; with `stop` it is ended";
      return Refuse(exchange, *lens, Fail(Code::Busy, why, {.activity = activity}).error());
    }
    StopAll(*lens, exchange);
  }
  Lease lease{.key = holds ? before->key : RandomName(),
              .holder = exchange->caller(),
              .owner = exchange->client(),
              .until = std::nullopt};
  if (for_ms != nullptr) {
    const std::chrono::duration<double, std::milli> time(for_ms->get<double>());
    lease.until = service.clock().Now() + std::chrono::duration_cast<Duration>(time);
  }
  // By name: a lens that is opened anew keeps its lease.
  exchange->AtClose(kLeaseKeys | std::hash<std::string>()(lens->name()),
                    [&service, name = lens->name(), owner = lease.owner] {
                      const auto here = std::ranges::find(service.lenses(), name, &ServedLens::name);
                      if (here != service.lenses().end()) (*here)->users().lease.Left(owner);
                    });
  exchange->Finish(varlink::WriteJson({{"lens", lens->name()}, {"lease", lease.key}}));
  lens->users().lease.Take(std::move(lease));
}

void DropLease(LensService& service, const ExchangePointer& exchange) {
  ServedLens* const lens = service.Find(exchange);
  if (lens == nullptr) return;
  if (const Lease* lease = lens->users().lease.now(); lease != nullptr && !Holds(*lease, exchange)) {
    return RefuseLeased(service, exchange, *lens, "its key ends it before");
  }
  lens->users().lease.Drop(LensLease::End::Dropped);
  exchange->Finish("{}");
}

}  // namespace

bool MayDrive(LensService& service, const Method& method, const ExchangePointer& exchange) {
  const bool drives = Drives(method, exchange);
  if (!drives && method.needs_lease != NeedsLease::ToChange) return true;
  ServedLens* const lens = service.Named(exchange);
  if (lens == nullptr) return true;
  const auto axis = exchange->view().Given("axis");
  if (auto why = !drives ? std::nullopt
                         : lens->users().stops.WhyStopped(exchange->number(),
                                                          axis ? drivers::AxisFromName(axis->text()) : std::nullopt)) {
    return Refuse(exchange, *lens, *why), false;
  }
  const Lease* const lease = lens->users().lease.now();
  if (lease == nullptr || Holds(*lease, exchange)) {
    if (drives) lens->users().driving.Note(exchange, service.clock().Now());
    return true;
  }
  RefuseLeased(service, exchange, *lens, "only who gives its key may move it before");
  return false;
}

MethodTable LeaseMethods(LensService& service) {
  return {{"TakeLease", [&service](const ExchangePointer& exchange) { TakeLease(service, exchange); }, Acts::InTurn,
           "takeOver"},
          {"DropLease", [&service](const ExchangePointer& exchange) { DropLease(service, exchange); }}};
}

}  // namespace lensd::daemon
