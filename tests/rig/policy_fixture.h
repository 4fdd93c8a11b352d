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
  static RigConfig WithBacklash(double backlash) {
    RigConfig config;
    config.axes[Axis::Focus].backlash = backlash;
    return config;
  }
  AxisStatus FocusStatus() { return *rig_->GetStatus().axes[Axis::Focus]; }
};

}  // namespace lensd::rig
