// How long something took, counted by how long.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>

#include "base/clock.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// Any thread adds and reads; what is read while something is added may lack it in part.
class Histogram {
 public:
  /// A count is of what took at most so long, and longer than the one before; one more count is of what took longer.
  static constexpr std::array<double, 16> kUpToMs = {0.1, 0.2, 0.5, 1,   2,   5,   10,  20,
                                                     50,  100, 200, 500, 1e3, 2e3, 5e3, 1e4};

  void Add(Duration took) { AddMs(std::chrono::duration<double, std::milli>(took).count()); }
  void AddMs(double ms) {
    const auto* const place = std::ranges::lower_bound(kUpToMs, ms);
    ++counts_[static_cast<std::size_t>(place - kUpToMs.begin())];
    sum_us_ += static_cast<std::int64_t>(ms * 1e3);
  }

  /// Histogram of the interface.
  varlink::Json Told() const {
    varlink::Json counts = varlink::Json::array();
    std::int64_t all = 0;
    for (const auto& count : counts_) {
      counts.push_back(count.load());
      all += count.load();
    }
    return {{"upToMs", kUpToMs},
            {"counts", std::move(counts)},
            {"count", all},
            {"sumMs", static_cast<double>(sum_us_.load()) * 1e-3}};
  }

 private:
  std::array<std::atomic<std::int64_t>, kUpToMs.size() + 1> counts_{};
  std::atomic<std::int64_t> sum_us_ = 0;
};

}  // namespace lensd::daemon
