// What the contract's tests share: opening a stand, waiting for rest, moving. Time is the stand's own.
#include "stand.h"

#include <cmath>

namespace lensd {

using drivers::Axis;

void ContractTest::SetUp() {
  stand_ = GetParam()();
  Open();
}

void ContractTest::Open() {
  auto opened = stand_->Open();
  ASSERT_TRUE(opened.has_value()) << opened.error().message;
  device_ = std::move(*opened);
}

bool ContractTest::Until(const std::function<bool()>& done) {
  for (Duration waited{}; waited < stand_->LongestMotion(); waited += stand_->LookEvery()) {
    if (done()) return true;
    if (HasFatalFailure()) return false;
    stand_->Advance(stand_->LookEvery());
  }
  return done();
}

void LensContract::SetUp() {
  ContractTest::SetUp();
  if (HasFatalFailure()) return;
  ASSERT_NE(device_.lens, nullptr) << "a stand for LensContract opens a device with a lens";
  HomeWhatNeedsIt();
}

void LensContract::OpenReady() {
  ASSERT_NO_FATAL_FAILURE(Open());
  HomeWhatNeedsIt();
}

void LensContract::HomeWhatNeedsIt() {
  for (const Axis axis : Axes()) {
    if (!lens().capabilities().axes[axis]->needs_home) continue;
    const auto state = lens().Read();
    ASSERT_TRUE(state.has_value()) << state.error().message;
    if (state->axes[axis]->homed) continue;
    const auto started = lens().StartHome(axis);
    ASSERT_TRUE(started.has_value()) << started.error().message;
    EXPECT_TRUE(RestOf(axis).homed) << drivers::AxisName(axis);
  }
}

std::vector<Axis> LensContract::Axes() const {
  std::vector<Axis> found;
  for (const Axis axis : drivers::kAxes) {
    if (device_.lens->capabilities().axes[axis]) found.push_back(axis);
  }
  return found;
}

Native LensContract::TargetAt(Axis axis, double fraction) const {
  const auto& can = *device_.lens->capabilities().axes[axis];
  const double steps = std::floor((can.maximum - can.minimum).value / can.resolution * fraction + 1e-9);
  return Native{can.minimum.value + steps * can.resolution};
}

drivers::AxisState LensContract::RestOf(Axis axis) {
  drivers::AxisState last;
  const bool rested = Until([&] {
    const auto state = lens().Read();
    if (!state) {
      ADD_FAILURE() << "Read() of an undisturbed lens: " << state.error().message;
      return true;
    }
    last = *state->axes[axis];
    return !last.moving;
  });
  EXPECT_TRUE(rested) << drivers::AxisName(axis) << " never came to rest; it is at " << last.position.value;
  return last;
}

void LensContract::ExpectAt(Axis axis, const drivers::AxisState& state, Native target) {
  const auto& can = *lens().capabilities().axes[axis];
  const double within =
      can.feedback != drivers::Feedback::None ? can.resolution + stand_->RestsWithin(axis) : can.resolution / 2.0;
  EXPECT_NEAR(state.position.value, target.value, within * (1.0 + 1e-9)) << drivers::AxisName(axis);
  EXPECT_EQ(state.fault, "") << drivers::AxisName(axis);
}

void LensContract::MoveAndRest(Axis axis, Native target) {
  const auto started = lens().StartMove(axis, target);
  ASSERT_TRUE(started.has_value()) << drivers::AxisName(axis) << ": " << started.error().message;
  ExpectAt(axis, RestOf(axis), target);
}

void CameraContract::SetUp() {
  ContractTest::SetUp();
  if (HasFatalFailure()) return;
  ASSERT_NE(device_.camera, nullptr) << "a stand for CameraContract opens a device with a camera";
}

std::optional<drivers::Frame> CameraContract::Next() {
  std::optional<drivers::Frame> next;
  Until([&] {
    auto frame = camera().Poll();
    if (!frame) {
      ADD_FAILURE() << "Poll(): " << frame.error().message;
      return true;
    }
    next = std::move(*frame);
    return next.has_value();
  });
  EXPECT_TRUE(next.has_value()) << "no frame came";
  return next;
}

}  // namespace lensd
