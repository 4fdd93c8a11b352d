// Who exposes through a lens, and until when what lensd does by itself waits for that.
#pragma once

#include <algorithm>
#include <map>

#include "base/clock.h"

namespace lensd::daemon {

/// One hold a connection. Event loop thread only.
class LensHolds {
 public:
  /// In place of what this connection held before.
  void Put(const void* owner, Instant until) { until_[owner] = until; }
  void Drop(const void* owner) { until_.erase(owner); }
  /// The end of the last of them; the beginning of time where there is none.
  Instant last() const {
    Instant last{};
    for (const auto& [owner, until] : until_) last = std::max(last, until);
    return last;
  }

 private:
  std::map<const void*, Instant> until_;
};

}  // namespace lensd::daemon
