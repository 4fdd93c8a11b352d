// A lease from its taking to its end, which is told when it comes and not when a client asks.
#include "daemon/lens/lens_lease.h"

#include <array>
#include <utility>

namespace lensd::daemon {

varlink::Json LeaseJson(const Lease* lease) {
  if (lease == nullptr) return nullptr;
  return {{"holder", lease->holder},
          {"untilNs", lease->until ? varlink::Json(lease->until->time_since_epoch().count()) : varlink::Json(nullptr)}};
}

LensLease::LensLease(EventLoop& loop, const Clock& clock, Told told)
    : clock_(clock), told_(std::move(told)), alarm_(loop, [this] { Expire(); }) {}

const Lease* LensLease::now() const {
  const bool over = lease_ && lease_->until && clock_.Now() >= *lease_->until;
  return lease_ && !over ? &*lease_ : nullptr;
}

void LensLease::Tell(const Lease& lease, std::string_view change, std::string_view cause) {
  varlink::Json json = LeaseJson(&lease);
  json["change"] = change;
  json["cause"] = cause.empty() ? varlink::Json(nullptr) : varlink::Json(cause);
  told_(json);
}

void LensLease::Take(Lease lease) {
  if (now() == nullptr) Drop(End::Expired);
  const std::string_view change = !lease_ ? "taken" : lease_->holder == lease.holder ? "renewed" : "takenOver";
  lease_ = std::move(lease);
  lease_->until ? alarm_.Set(*lease_->until) : alarm_.Off();
  Tell(*lease_, change, "");
}

void LensLease::Left(const void* owner) {
  if (!lease_ || lease_->owner != owner) return;
  if (!lease_->until) return Drop(End::Disconnected);
  lease_->owner = nullptr;
}

void LensLease::Drop(End cause) {
  static constexpr std::array<std::string_view, 4> kCauses = {"dropped", "expired", "disconnected", "reopened"};
  const auto ended = std::exchange(lease_, std::nullopt);
  if (!ended) return;
  const bool over = ended->until && clock_.Now() >= *ended->until;
  alarm_.Off();
  Tell(*ended, "ended", kCauses.at(static_cast<std::size_t>(over ? End::Expired : cause)));
}

void LensLease::GoOnFrom(LensLease& before) {
  before.alarm_.Off();
  lease_ = std::exchange(before.lease_, std::nullopt);
  if (!lease_) return;
  if (lease_->until) alarm_.Set(*lease_->until);
  Tell(*lease_, "renewed", "");
}

void LensLease::Expire() {
  if (now() == nullptr) Drop(End::Expired);
  if (lease_ && lease_->until) alarm_.Set(*lease_->until);
}

}  // namespace lensd::daemon
