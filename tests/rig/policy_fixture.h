// A rig of a stepped clock with the rules of motion set.
#pragma once

#include "rig_fixture.h"

namespace lensd::rig {

using namespace std::chrono_literals;

class PolicyTest : public RigTest {
 protected:
  Result<MoveOutcome> Move(double target, Axis axis = Axis::Focus) {
    Answers<MoveOutcome> answers;
    rig_->Move(axis, At(target), answers.Take());
    RunUntil(answers);
    return answers.only();
  }
  /// How a motion to 900 ends during which another program sends the axis to 50.
  Result<MoveOutcome> TakenAway() {
    Answers<MoveOutcome> answers;
    rig_->Move(Axis::Focus, At(900), answers.Take());
    Run(200ms);
    controls_->foreign_target = 50;
    RunUntil(answers);
    return answers.only();
  }
  static RigConfig WithBacklash(double backlash) {
    RigConfig config;
    config.axes[Axis::Focus].backlash = backlash;
    return config;
  }
  AxisStatus FocusStatus() { return *rig_->GetStatus().axes[Axis::Focus]; }
};

}  // namespace lensd::rig
