// Which calls drive a lens just now, for those who are refused because of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "daemon/server/exchange.h"

namespace lensd::daemon {

/// A call that drives a lens.
struct DrivingCall {
  std::weak_ptr<const Exchange> call;  ///< gone once it is answered and, of a session, once that has ended
  std::string caller;                  ///< for people
  Instant since;
};

/// Event loop thread only.
class DrivingCalls {
 public:
  /// A call may drive the lens from now on, until its keeper lets go of it.
  void Note(const ExchangePointer& call, Instant now) {
    std::erase_if(calls_, [](const DrivingCall& each) { return each.call.expired(); });
    calls_.push_back({call, call->caller(), now});
    ++noted_;
  }
  /// How many calls have driven the lens so far.
  std::uint64_t noted() const { return noted_; }
  /// Whether one does now.
  bool any() const {
    return std::ranges::any_of(calls_, [](const DrivingCall& each) { return !each.call.expired(); });
  }
  /// Of the calls that drive the lens, but for this one, the one that has done so for longest.
  std::optional<DrivingCall> But(const Exchange& call) const {
    const auto found = std::ranges::find_if(calls_, [&](const DrivingCall& each) {
      const auto kept = each.call.lock();
      return kept && kept.get() != &call;
    });
    return found == calls_.end() ? std::nullopt : std::optional(*found);
  }
  /// The same but for the calls of one connection.
  std::optional<DrivingCall> ButOf(const void* client) const {
    const auto found = std::ranges::find_if(calls_, [&](const DrivingCall& each) {
      const auto kept = each.call.lock();
      return kept && kept->client() != client;
    });
    return found == calls_.end() ? std::nullopt : std::optional(*found);
  }

 private:
  std::vector<DrivingCall> calls_;  // oldest first
  std::uint64_t noted_ = 0;
};

}  // namespace lensd::daemon
