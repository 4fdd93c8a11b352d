// Moves of the focus axis, and how they end.
#pragma once

#include "rig_fixture.h"

namespace lensd::rig {

using namespace std::chrono_literals;

class MotionTest : public RigTest {
 protected:
  Answers<MoveOutcome> Move(double target, Duration for_at_most = 100s) {
    Answers<MoveOutcome> answers;
    rig_->Move(Axis::Focus, At(target), answers.Take());
    RunUntil(answers, for_at_most);
    return answers;
  }
};

}  // namespace lensd::rig
