// Which calls may no longer move a lens, because a stop came after them or holds.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "drivers/api/lens.h"

namespace lensd::daemon {

/// Event loop thread only, but for latched().
class StopLatch {
 public:
  explicit StopLatch(std::string lens) : lens_(std::move(lens)) {}

  /// A call of this number stops these axes, all of them if empty: those before it that would move them are over. With
  /// `latch` none moves until Unlatch().
  void Note(std::uint64_t number, const std::vector<drivers::Axis>& axes, bool latch) {
    for (const drivers::Axis axis : drivers::kAxes) {
      if (axes.empty() || std::ranges::find(axes, axis) != axes.end()) number_[axis] = number;
    }
    if (latch) latched_ = true;
  }
  void Unlatch() { latched_ = false; }
  bool latched() const { return latched_; }
  /// The number of the newest call that stopped an axis; 0: none did.
  std::uint64_t newest() const {
    std::uint64_t newest = 0;
    for (const drivers::Axis axis : drivers::kAxes) newest = std::max(newest, number_[axis]);
    return newest;
  }
  /// Why a call may not move an axis, or any of them: a stop came after it, or holds.
  std::optional<Error> WhyStopped(std::uint64_t number, std::optional<drivers::Axis> axis) const {
    if (latched_) return Error{Code::Cancelled, "lens \"" + lens_ + "\" was stopped for good: reset its faults first"};
    for (const drivers::Axis each : drivers::kAxes) {
      if ((!axis || each == *axis) && number < number_[each]) return Error{Code::Cancelled, "stopped"};
    }
    return std::nullopt;
  }

 private:
  const std::string lens_;
  drivers::PerAxis<std::uint64_t> number_{};  // of the last call that stopped it
  std::atomic<bool> latched_ = false;
};

}  // namespace lensd::daemon
