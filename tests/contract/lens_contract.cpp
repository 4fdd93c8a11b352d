// What every lens promises, whatever drives it.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "open_files.h"
#include "rig/rig.h"
#include "stand.h"

namespace lensd {

using drivers::Axis;
using drivers::AxisName;

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LensContract);

TEST_P(LensContract, SaysWhatItIs) {
  const drivers::Capabilities can = lens().capabilities();
  EXPECT_NE(can.driver, "");
  EXPECT_NE(can.model, "");
  ASSERT_FALSE(Axes().empty()) << "a lens without an axis is no lens";
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    EXPECT_TRUE(std::isfinite(can.axes[axis]->minimum.value));
    EXPECT_TRUE(std::isfinite(can.axes[axis]->maximum.value));
    EXPECT_LT(can.axes[axis]->minimum, can.axes[axis]->maximum);
    EXPECT_GT(can.axes[axis]->resolution, 0.0);
    EXPECT_GE(can.axes[axis]->speed, 0.0);
    EXPECT_GE(can.axes[axis]->settle, Duration::zero());
    if (can.axes[axis]->needs_home) {
      EXPECT_TRUE(can.axes[axis]->can_home);
    }
  }
}

TEST_P(LensContract, ReadsTheAxesItHas) {
  const Instant before = stand_->clock().Now();
  const auto state = lens().Read();
  ASSERT_TRUE(state.has_value()) << state.error().message;
  EXPECT_GE(state->sampled_at, before);
  EXPECT_LE(state->sampled_at, stand_->clock().Now());
  for (const Axis axis : drivers::kAxes) {
    EXPECT_EQ(state->axes[axis].has_value(), lens().capabilities().axes[axis].has_value()) << AxisName(axis);
  }
}

TEST_P(LensContract, MovesEveryAxisFromEndToEnd) {
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    for (const double fraction : {0.5, 1.0, 0.0, 0.25}) {
      ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, fraction)));
    }
  }
}

TEST_P(LensContract, MovesToWhereItIs) {
  for (const Axis axis : Axes()) {
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.5)));
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.5)));
  }
}

TEST_P(LensContract, RefusesWhatIsOutsideItsLimits) {
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    const auto& can = *lens().capabilities().axes[axis];
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.5)));
    const double outside[] = {can.minimum.value - can.resolution, can.maximum.value + can.resolution, 1e300, -1e300};
    for (const double target : outside) {
      EXPECT_EQ(CodeOf(lens().StartMove(axis, Native{target})), Code::OutOfRange) << target;
    }
    for (const double target : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(CodeOf(lens().StartMove(axis, Native{target})), Code::InvalidArgument) << target;
    }
    ExpectAt(axis, RestOf(axis), TargetAt(axis, 0.5));
  }
}

TEST_P(LensContract, RefusesAxesItLacks) {
  for (const Axis axis : drivers::kAxes) {
    if (lens().capabilities().axes[axis]) continue;
    EXPECT_EQ(CodeOf(lens().StartMove(axis, Native{0.0})), Code::Unsupported) << AxisName(axis);
    EXPECT_EQ(CodeOf(lens().StartHome(axis)), Code::Unsupported) << AxisName(axis);
    EXPECT_EQ(CodeOf(lens().Stop(axis)), Code::Unsupported) << AxisName(axis);
  }
}

TEST_P(LensContract, HomesOrSaysItCannot) {
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    const auto started = lens().StartHome(axis);
    if (!lens().capabilities().axes[axis]->can_home) {
      EXPECT_EQ(CodeOf(started), Code::Unsupported);
      continue;
    }
    ASSERT_TRUE(started.has_value()) << started.error().message;
    EXPECT_TRUE(RestOf(axis).homed);
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.5)));
  }
}

TEST_P(LensContract, StopsInMidMoveOrSaysItCannot) {
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    if (!lens().capabilities().axes[axis]->can_stop) {
      EXPECT_EQ(CodeOf(lens().Stop(axis)), Code::Unsupported);
      continue;
    }
    const Native from = TargetAt(axis, 0.0), to = TargetAt(axis, 1.0);
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, from));
    ASSERT_TRUE(lens().StartMove(axis, to).has_value());
    stand_->Advance(stand_->LookEvery());
    const auto stopped = lens().Stop(axis);
    ASSERT_TRUE(stopped.has_value()) << stopped.error().message;
    const drivers::AxisState rest = RestOf(axis);
    const double slack = lens().capabilities().axes[axis]->resolution + stand_->RestsWithin(axis);
    EXPECT_GE(rest.position.value, from.value - slack);
    EXPECT_LE(rest.position.value, to.value + slack);
    // It stays there, and it takes orders again.
    stand_->Advance(10 * stand_->LookEvery());
    EXPECT_NEAR(RestOf(axis).position.value, rest.position.value, slack);
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.75)));
    // Harmless at rest.
    EXPECT_TRUE(lens().Stop(axis).has_value());
    ExpectAt(axis, RestOf(axis), TargetAt(axis, 0.75));
  }
}

TEST_P(LensContract, TakesANewTargetInMidMove) {
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.0)));
    ASSERT_TRUE(lens().StartMove(axis, TargetAt(axis, 1.0)).has_value());
    stand_->Advance(stand_->LookEvery());
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.25)));
  }
}

TEST_P(LensContract, AnInterruptIsHarmlessOrCancels) {
  const Axis axis = Axes().front();
  ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.0)));
  std::atomic<bool> done{false};
  std::atomic<int> interrupts{0};
  std::thread other([&] {
    while (!done) {
      lens().Interrupt();
      ++interrupts;
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  for (int i = 0; i < 50 || interrupts < 20; ++i) {
    const auto moved = lens().StartMove(axis, TargetAt(axis, i % 2 == 0 ? 0.5 : 0.25));
    if (!moved) {
      EXPECT_EQ(moved.error().code, Code::Cancelled) << moved.error().message;
    }

    const auto read = lens().Read();
    if (!read) {
      EXPECT_EQ(read.error().code, Code::Cancelled) << read.error().message;
    }

    stand_->Advance(stand_->LookEvery());
  }
  done = true;
  other.join();
  // No interrupt is left over, and none has upset the conversation with the device.
  EXPECT_TRUE(lens().Read().has_value());
  ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.75)));
  lens().Interrupt();
  ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.25)));
}

TEST_P(LensContract, UnpluggedInMidMoveIsDisconnected) {
  const Axis axis = Axes().front();
  ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.0)));
  ASSERT_TRUE(lens().StartMove(axis, TargetAt(axis, 1.0)).has_value());
  if (!stand_->Unplug()) GTEST_SKIP() << "this stand cannot unplug its device";
  EXPECT_TRUE(Until([&] {
    const auto read = lens().Read();
    return !read && read.error().code == Code::Disconnected;
  })) << "Read() never said Disconnected";
  EXPECT_EQ(CodeOf(lens().Read()), Code::Disconnected);
  EXPECT_EQ(CodeOf(lens().StartMove(axis, TargetAt(axis, 0.5))), Code::Disconnected);
  if (lens().capabilities().axes[axis]->can_stop) {
    EXPECT_EQ(CodeOf(lens().Stop(axis)), Code::Disconnected);
  }

  if (lens().capabilities().axes[axis]->can_home) {
    EXPECT_EQ(CodeOf(lens().StartHome(axis)), Code::Disconnected);
  }

  Close();
  stand_->Plug();
  ASSERT_NO_FATAL_FAILURE(OpenReady());
  ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.5)));
}

/// Whatever it said last: a rig on a lens that is gone says that it moves nowhere, that its place is not known, and
/// marks where it was.
TEST_P(LensContract, GoneMeansUnknown) {
  const Axis axis = Axes().front();
  ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.0)));
  const Native far = TargetAt(axis, 1.0);
  std::optional<Code> ended;  // outlives the rig, which answers as it goes
  auto made = rig::Rig::Create({}, std::move(device_), stand_->clock());
  ASSERT_TRUE(made) << made.error().message;
  rig::Rig& rig = **made;
  rig.Move(axis, {.kind = rig::Target::Kind::Native, .value = far.value, .from = {}, .take_up = {}},
           [&](Result<rig::MoveOutcome> end) { ended = end ? Code::Internal : end.error().code; });
  rig.Step(stand_->clock().Now());
  EXPECT_TRUE(rig.GetStatus().axes[axis]->moving);
  if (!stand_->Unplug()) GTEST_SKIP() << "this stand cannot unplug its device";
  EXPECT_TRUE(Until([&] {
    rig.Step(stand_->clock().Now());
    return !rig.GetStatus().connected;
  }));
  const rig::Status status = rig.GetStatus();
  for (const Axis each : drivers::kAxes) {
    if (!status.axes[each]) continue;
    EXPECT_FALSE(status.axes[each]->moving || status.axes[each]->homed) << AxisName(each);
    EXPECT_TRUE(status.axes[each]->last_known) << AxisName(each);
  }
  EXPECT_FALSE(status.vergence || status.extension || status.f_number);
  EXPECT_NE(status.problem, "");
  EXPECT_TRUE(ended);
}

TEST_P(LensContract, AnUnpluggedOneIsNotOpened) {
  if (!stand_->Unplug()) GTEST_SKIP() << "this stand cannot unplug its device";
  Close();
  const auto opened = stand_->Open();
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, Code::Disconnected) << opened.error().message;
  EXPECT_NE(opened.error().message, "");
}

TEST_P(LensContract, ReopensWithoutLeaks) {
  Close();
  ASSERT_NO_FATAL_FAILURE(OpenReady());
  Close();
  const int open_files = testing::OpenFiles();
  for (int i = 0; i < 5; ++i) {
    ASSERT_NO_FATAL_FAILURE(OpenReady());
    for (const Axis axis : Axes()) ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, i % 2 == 0 ? 0.5 : 0.25)));
    Close();
  }
  EXPECT_EQ(testing::OpenFiles(), open_files);
}

TEST_P(LensContract, IsDestroyedDuringAMove) {
  for (const Axis axis : Axes()) {
    SCOPED_TRACE(AxisName(axis));
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.0)));
    ASSERT_TRUE(lens().StartMove(axis, TargetAt(axis, 1.0)).has_value());
    stand_->Advance(stand_->LookEvery());
    Close();
    ASSERT_NO_FATAL_FAILURE(OpenReady());
    RestOf(axis);
    ASSERT_NO_FATAL_FAILURE(MoveAndRest(axis, TargetAt(axis, 0.5)));
  }
}

}  // namespace lensd
