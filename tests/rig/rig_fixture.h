// A rig on a fake device and a stepped clock, driven the way a worker drives it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "fake_device.h"
#include "rig/rig.h"

namespace lensd::rig {

using drivers::Axis;

/// Collects what a callback is given.
template <class T>
struct Answers {
  std::vector<Result<T>> all;
  auto Take() {
    return [this](Result<T> answer) { all.push_back(std::move(answer)); };
  }
  const Result<T>& only() const {
    EXPECT_EQ(all.size(), 1u);
    return all.at(0);
  }
};

class RigTest : public ::testing::Test {
 protected:
  void Open(RigConfig config = {}, double focus = 100.0, std::unique_ptr<PositionMemory> memory = nullptr) {
    auto made = Rig::Create(std::move(config), testing::MakeFakeDevice(clock_, controls_, focus), clock_, nullptr,
                            std::move(memory));
    ASSERT_TRUE(made) << made.error().message;
    rig_ = *std::move(made);
  }
  /// Steps the rig for that long, as a worker would: whenever it asks to be called.
  void Run(Duration how_long) {
    const Instant end = clock_.Now() + how_long;
    while (clock_.Now() < end) {
      const Instant next = rig_->Step(clock_.Now());
      clock_.AdvanceTo(std::min(std::max(next, clock_.Now() + std::chrono::microseconds(100)), end));
    }
  }
  template <class T>
  void RunUntil(const Answers<T>& answers, Duration at_most = std::chrono::seconds(100)) {
    const Instant end = clock_.Now() + at_most;
    while (answers.all.empty() && clock_.Now() < end) Run(std::chrono::milliseconds(1));
  }
  double Focus() { return rig_->GetStatus().axes[Axis::Focus]->position.value; }

  SteppedClock clock_;
  std::shared_ptr<testing::FakeControls> controls_ = std::make_shared<testing::FakeControls>();
  std::unique_ptr<Rig> rig_;
};

inline Target At(double native) {
  return {.kind = Target::Kind::Native, .value = native, .from = {}, .take_up = {}};
}

}  // namespace lensd::rig
