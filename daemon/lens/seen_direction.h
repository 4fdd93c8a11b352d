// The direction of focus that was seen since lensd began, whatever its file says.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/api/lens.h"

namespace lensd::daemon {

/// By the serial number of the device. Any thread.
class SeenDirection {
 public:
  using Seen = std::optional<drivers::Direction>;
  /// The same lens was served so before.
  void TakeOver(const SeenDirection& before) {
    auto seen = before.All();
    const std::lock_guard lock(mutex_);
    seen_.swap(seen);
  }
  void Put(const std::string& serial, Seen seen) {
    const std::lock_guard lock(mutex_);
    seen_[serial] = seen;
  }
  /// Nothing: not since lensd began. Otherwise what is seen, or that it was forgotten.
  std::optional<Seen> Get(const std::string& serial) const {
    const std::lock_guard lock(mutex_);
    const auto found = seen_.find(serial);
    std::optional<Seen> known;
    if (found != seen_.end()) known.emplace(found->second);
    return known;
  }

 private:
  std::map<std::string, Seen> All() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }
  mutable std::mutex mutex_;
  std::map<std::string, Seen> seen_;  // guarded by mutex_
};

}  // namespace lensd::daemon
