// The faults of a scene on the world's time, and those added while it runs.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "sim/scene.h"

namespace lensd::sim {

/// Answers which fault is in force when. Times count from the making of the world. Not thread-safe.
class FaultLine {
 public:
  explicit FaultLine(const std::vector<Fault>& faults);

  /// Adds a fault that begins now or later, when everything due by now has been taken. It ends the one of its kind (and
  /// axis, where the kind is about one) that is in force then; a reconnect ends every disconnect. What has long been
  /// over is forgotten.
  void Add(const Fault& fault);
  /// The fault of that kind in force at `at`, the latest begun; none: nothing is wrong. `axis` where the kind is about
  /// one.
  std::optional<Fault> ActiveAt(FaultKind kind, Duration at, std::optional<drivers::Axis> axis = std::nullopt) const;
  /// Between a disconnect and its end or the next reconnect.
  bool DisconnectedAt(Duration at) const;

  /// Something that happens to a mechanism at one instant.
  struct Event {
    Duration at{};
    Fault fault;
    bool begins = true;
  };
  /// Beginnings and ends of stalls and missed steps, jumps, and disconnects, in order of time: each once, when it is
  /// due by `now`.
  std::optional<Event> TakeDue(Duration now);

 private:
  void Insert(const Fault& fault);
  void EndAt(Fault& fault, Duration at);

  std::vector<Fault> faults_;     ///< by time
  std::deque<Event> mechanical_;  ///< not taken yet
};

/// When a fault begins, and when it ends (never: the greatest duration).
Duration BeginOf(const Fault& fault);
Duration EndOf(const Fault& fault);
/// Whether faults of that kind are about one axis.
bool IsOfOneAxis(FaultKind kind);

}  // namespace lensd::sim
