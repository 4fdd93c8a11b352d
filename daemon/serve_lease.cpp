// TakeLease, DropLease, and whom a lease keeps from moving a lens.
#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"

namespace lensd::daemon {
namespace {

using proto::Json;

constexpr double kLongestMs = 24.0 * 3600.0 * 1e3;
/// Keys of what a connection leaves behind when it closes: sessions count from 1, leases from here.
constexpr std::uint64_t kLeaseKeys = std::uint64_t{1} << 63;

std::string NewKey() {
  std::random_device random;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x", random(), random());
  return text.data();
}

/// Whether a call moves a lens: those methods take a lease's key. A plan that is not applied does not.
bool Drives(const proto::MethodDefinition& method, std::string_view name, proto::JsonView parameters) {
  if (name == "DropLease") return false;
  if (name == "Plan") {
    const auto apply = parameters.Given("apply");
    return apply && apply->boolean();
  }
  return std::ranges::any_of(method.input->fields, [](const auto& field) { return field.name == "lease"; });
}

}  // namespace

bool LensService::LeaseHolds(Lens& lens) const {
  if (lens.lease && lens.lease->until && clock_.Now() >= *lens.lease->until) lens.lease.reset();
  return lens.lease.has_value();
}

bool LensService::MayDrive(std::string_view method, const ExchangePointer& exchange) {
  if (!Drives(definition_.methods().find(method)->second, method, exchange->view())) return true;
  const Json& parameters = exchange->parameters();
  const Json* named = Given(parameters, "lens");
  const auto found = std::ranges::find_if(
      lenses_, [&](const auto& lens) { return named == nullptr ? lenses_.size() == 1 : *named == lens->name; });
  if (found == lenses_.end() || !LeaseHolds(**found)) return true;
  const Lens::Lease& lease = *(*found)->lease;
  const Json* key = Given(parameters, "lease");
  if ((lease.owner != nullptr && lease.owner == exchange->peer()) || (key != nullptr && *key == lease.key)) return true;
  Refuse(exchange, {Code::Busy, "lens \"" + (*found)->name + "\" is leased to somebody else, who alone may move it"});
  return false;
}

void LensService::TakeLease(const ExchangePointer& exchange) {
  Lens* const lens = FindNamed(exchange);
  if (lens == nullptr) return;
  const Json* for_ms = Given(exchange->parameters(), "forMs");
  if (for_ms != nullptr && !(for_ms->get<double>() > 0.0 && for_ms->get<double>() <= kLongestMs)) {
    return Refuse(exchange, {Code::InvalidArgument, "forMs is above 0 and at most a day"});
  }
  if (exchange->peer() == nullptr) {
    return Refuse(exchange, {Code::InvalidArgument, "a lease has an answer: it cannot be taken by a oneway call"});
  }
  if (LeaseHolds(*lens) && lens->lease->owner != exchange->peer()) {
    return Refuse(exchange, {Code::Busy, "lens \"" + lens->name + "\" is leased to somebody else already"});
  }
  Lens::Lease lease{.key = NewKey(), .owner = nullptr, .until = std::nullopt};
  if (for_ms != nullptr) {
    const std::chrono::duration<double, std::milli> time(for_ms->get<double>());
    lease.until = clock_.Now() + std::chrono::duration_cast<Duration>(time);
  } else {
    lease.owner = exchange->peer();
    const auto index = static_cast<std::uint64_t>(
        std::ranges::find(lenses_, lens, [](const auto& each) { return each.get(); }) - lenses_.begin());
    exchange->AtClose(kLeaseKeys + index, [lens, owner = lease.owner] {
      if (lens->lease && lens->lease->owner == owner) lens->lease.reset();
    });
  }
  lens->lease = lease;
  exchange->Finish(proto::WriteJson({{"lens", lens->name}, {"lease", lease.key}}));
}

void LensService::DropLease(const ExchangePointer& exchange) {
  Lens* const lens = FindNamed(exchange);
  if (lens == nullptr) return;
  if (LeaseHolds(*lens)) {
    const Json* key = Given(exchange->parameters(), "lease");
    const bool own = lens->lease->owner != nullptr && lens->lease->owner == exchange->peer();
    if (!own && !(key != nullptr && *key == lens->lease->key)) {
      return Refuse(exchange,
                    {Code::Busy, "the lease of lens \"" + lens->name + "\" is somebody else's; give its key"});
    }
    lens->lease.reset();
  }
  exchange->Finish("{}");
}

}  // namespace lensd::daemon
