// For procedures of many commands: the next one is given only if no other caller has given one meanwhile.
#pragma once

#include <utility>
#include <vector>

#include "rig/rig.h"

namespace lensd::rig {

/// Passes commands on to a rig. Once another caller has commanded a motion or autofocus of one of these axes (none
/// named: of any), each further command is answered Superseded without touching the rig; Cancelled after a stop of
/// them. On the rig's thread; the rig must outlive it but for callbacks.
class CommandGuard {
 public:
  explicit CommandGuard(Rig& rig, std::vector<drivers::Axis> axes = {})
      : rig_(rig), axes_(std::move(axes)), mine_(rig.commands_given(axes_)) {}

  void Move(drivers::Axis axis, const Target& target, MoveCallback done) {
    if (auto given = Check<MoveOutcome>(); !given) return done(std::move(given));
    rig_.Move(axis, target, std::move(done));
    mine_ = rig_.commands_given(axes_);
  }
  void Autofocus(AutofocusRequest request, AutofocusCallback done) {
    if (auto given = Check<AutofocusOutcome>(); !given) return done(std::move(given));
    rig_.Autofocus(std::move(request), nullptr, std::move(done));
    mine_ = rig_.commands_given(axes_);
  }
  void Snapshot(SnapshotCallback done) {
    if (auto given = Check<LensedFrame>(); !given) return done(std::move(given));
    rig_.Snapshot(std::move(done));
  }

 private:
  template <class T>
  Result<T> Check() const {
    const CommandCount now = rig_.commands_given(axes_);
    if (now.stops != mine_.stops) return Fail(Code::Cancelled, "stopped");
    if (now.given != mine_.given) return Fail(Code::Superseded, "another command for this lens took over");
    return T{};
  }

  Rig& rig_;
  const std::vector<drivers::Axis> axes_;
  CommandCount mine_;
};

}  // namespace lensd::rig
