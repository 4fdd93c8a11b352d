// For procedures of many commands: the next one is given only if no other caller has given one meanwhile.
#pragma once

#include <utility>

#include "rig/rig.h"

namespace lensd::rig {

/// Passes commands on to a rig. Once another caller has commanded a motion or autofocus, each further command is
/// answered Superseded without touching the rig; Cancelled after a stop, of whatever axes. On the rig's thread; the rig
/// must outlive it but for callbacks.
class CommandGuard {
 public:
  explicit CommandGuard(Rig& rig) : rig_(rig), mine_(rig.commands_given()), stops_(rig.stops_given()) {}

  void Move(drivers::Axis axis, const Target& target, MoveCallback done) {
    if (auto given = Check<MoveOutcome>(); !given) return done(std::move(given));
    rig_.Move(axis, target, std::move(done));
    mine_ = rig_.commands_given();
  }
  void Autofocus(AutofocusRequest request, AutofocusCallback done) {
    if (auto given = Check<AutofocusOutcome>(); !given) return done(std::move(given));
    rig_.Autofocus(std::move(request), nullptr, std::move(done));
    mine_ = rig_.commands_given();
  }
  void Snapshot(SnapshotCallback done) {
    if (auto given = Check<LensedFrame>(); !given) return done(std::move(given));
    rig_.Snapshot(std::move(done));
  }
  bool displaced() const { return rig_.commands_given() != mine_; }

 private:
  template <class T>
  Result<T> Check() const {
    if (rig_.stops_given() != stops_) return Fail(Code::Cancelled, "stopped");
    if (displaced()) return Fail(Code::Superseded, "another command for this lens took over");
    return T{};
  }

  Rig& rig_;
  std::uint64_t mine_;
  const std::uint64_t stops_;
};

}  // namespace lensd::rig
