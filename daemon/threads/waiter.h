// Who waits for what a worker will tell.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::daemon {

/// Event loop thread only.
class Waiter {
 public:
  virtual ~Waiter() = default;
  /// Is told this instead, unless it has been told already; whatever comes later is not listened to.
  virtual void GiveUp(const Error& why) = 0;

 protected:
  Waiter() = default;
  Waiter(const Waiter&) = default;
  Waiter& operator=(const Waiter&) = default;
};

/// All of one lens. Event loop thread only.
class Waiters {
 public:
  /// With `until`, for whom GiveUpOverdue() is meant once that is past.
  void Add(std::weak_ptr<Waiter> waiter, std::optional<Instant> until = std::nullopt) {
    if (waiters_.size() >= prune_at_) {
      std::erase_if(waiters_, [](const Entry& entry) { return entry.waiter.expired(); });
      prune_at_ = std::max(kFew, 2 * waiters_.size());
    }
    waiters_.push_back({std::move(waiter), until});
  }
  void GiveUpAll(const Error& why) {
    for (const Entry& entry : std::exchange(waiters_, {})) {
      if (const auto waiter = entry.waiter.lock()) waiter->GiveUp(why);
    }
  }
  void GiveUpOverdue(Instant now, const Error& why) {
    std::vector<Entry> overdue;
    std::erase_if(waiters_, [&](Entry& entry) {
      const bool over = entry.until && *entry.until <= now;
      if (over) overdue.push_back(std::move(entry));
      return over;
    });
    for (const Entry& entry : overdue) {
      if (const auto waiter = entry.waiter.lock()) waiter->GiveUp(why);
    }
  }

 private:
  static constexpr std::size_t kFew = 32;
  struct Entry {
    std::weak_ptr<Waiter> waiter;
    std::optional<Instant> until;
  };
  std::vector<Entry> waiters_;
  std::size_t prune_at_ = kFew;
};

}  // namespace lensd::daemon
