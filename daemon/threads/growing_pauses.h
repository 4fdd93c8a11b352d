// How long to wait before a device is opened again that fails again and again.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include "base/clock.h"
#include "daemon/threads/retry.h"

namespace lensd::daemon {

/// None at first, then longer ones, up to Retry::kLongestPause. They begin anew once a device has worked for kWorks.
class GrowingPauses {
 public:
  static constexpr Duration kWorks = std::chrono::seconds(10);

  /// Of a device that works at `now`.
  explicit GrowingPauses(Instant now) : works_since_(now) {}
  /// The next one does.
  void Works(Instant now) { works_since_ = now; }
  /// It has failed at `now`.
  Duration Next(Instant now) {
    if (works_since_ && now - *std::exchange(works_since_, std::nullopt) >= kWorks) next_ = {};
    const Duration pause = next_;
    next_ = pause == Duration{} ? Retry::kFirstPause : std::min(2 * pause, Retry::kLongestPause);
    return pause;
  }

 private:
  std::optional<Instant> works_since_;  ///< nothing: it has failed since
  Duration next_{};
};

}  // namespace lensd::daemon
