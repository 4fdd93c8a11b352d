// The faults of a scene on the world's time.
#pragma once

#include <optional>
#include <vector>

#include "base/clock.h"
#include "sim/scene.h"

namespace lensd::sim {

/// Answers which fault is in force when. Times count from the making of the world.
class FaultLine {
 public:
  explicit FaultLine(const std::vector<Fault>& faults);

  /// The fault of that kind in force at `at`, the latest begun; nullptr: none. `axis` where the kind is about one.
  const Fault* ActiveAt(FaultKind kind, Duration at, std::optional<drivers::Axis> axis = std::nullopt) const;
  /// Between a disconnect and its end or the next reconnect.
  bool DisconnectedAt(Duration at) const;

  /// Something that happens to a mechanism at one instant.
  struct Event {
    Duration at{};
    Fault fault;
    bool begins = true;
  };
  /// Beginnings and ends of stalls and missed steps, and jumps, in order of time.
  const std::vector<Event>& mechanical() const { return mechanical_; }

 private:
  std::vector<Fault> faults_;  ///< by time
  std::vector<Event> mechanical_;
};

/// When a fault begins, and when it ends (never: the greatest duration).
Duration BeginOf(const Fault& fault);
Duration EndOf(const Fault& fault);

}  // namespace lensd::sim
