// Thousands of moves through a rig while the lens, its bridge and its cable go wrong at random.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "lensconnect_lens.h"
#include "model_transport.h"
#include "open_files.h"
#include "rig/rig.h"
#include "test_level.h"

namespace lensd {
namespace {

using namespace std::chrono_literals;
using drivers::Axis;
using sim::devices::LensConnectAxis;
using sim::devices::LensConnectFault;

constexpr Duration kNeverLonger = 60s;

LensConnectAxis ModelAxis(Axis axis) {
  switch (axis) {
    case Axis::Focus:
      return LensConnectAxis::Focus;
    case Axis::Iris:
      return LensConnectAxis::Iris;
    case Axis::Zoom:
      return LensConnectAxis::Zoom;
    case Axis::Filter:
      return LensConnectAxis::Filter;
  }
  return LensConnectAxis::Focus;
}

class Storm {
 public:
  explicit Storm(unsigned seed) : random_(seed) { Open(); }

  /// One move or homing with whatever goes wrong meanwhile. False: it never ended.
  bool Once() {
    const Axis axis = drivers::kAxes[random_() % drivers::kAxes.size()];
    const auto [low, high] = rig_->SoftLimits(axis);
    const double target = low.value + static_cast<double>(random_() % static_cast<unsigned>((high - low).value + 1));
    const bool home = random_() % 20 == 0 || !rig_->GetStatus().axes[axis] || !rig_->GetStatus().axes[axis]->homed;
    std::optional<Result<rig::MoveOutcome>> end;
    const auto take = [&](Result<rig::MoveOutcome> outcome) { end = std::move(outcome); };
    if (home) {
      rig_->Home(axis, take);
    } else {
      rig_->Move(axis, {.kind = rig::Target::Kind::Native, .value = target, .from = {}}, take);
    }
    const Instant until = clock_.Now() + kNeverLonger;
    Instant next_fault = clock_.Now() + Random(200ms);
    while (!end && clock_.Now() < until) {
      if (clock_.Now() >= next_fault) {
        GoWrong();
        next_fault = clock_.Now() + Random(1500ms);
      }
      const Instant next = rig_->Step(clock_.Now());
      clock_.AdvanceTo(std::max(next, clock_.Now() + 100us));
    }
    if (!end) return false;
    Judge(*end, axis, home, target);
    CalmDown();
    return true;
  }

  int reached = 0, not_reached = 0, errors = 0, false_reached = 0, faults = 0;

 private:
  void Open() {
    auto lens = drivers::lensconnect::LensConnectLens::Open(std::make_unique<testing::ModelTransport>(model_, clock_),
                                                            {}, "A123", findings_, clock_);
    ASSERT_TRUE(lens) << lens.error().message;
    auto rig = rig::Rig::Create({}, {.lens = *std::move(lens), .camera = nullptr, .optics = {}}, clock_);
    ASSERT_TRUE(rig);
    rig_ = *std::move(rig);
  }
  Duration Random(Duration below) { return Duration(static_cast<Duration::rep>(random_() % below.count())); }

  void GoWrong() {
    ++faults;
    const auto kind = random_() % 11;
    last_fault_ = static_cast<int>(kind);
    last_fault_at_ = clock_.Now();
    if (kind < sim::devices::kLensConnectFaults.size()) {
      model_->lens.Spoil(sim::devices::kLensConnectFaults[kind], 1 + static_cast<int>(random_() % 4));
    } else if (kind == 7) {
      model_->lens.motor(static_cast<LensConnectAxis>(random_() % 4)).Jam();
    } else if (kind == 8) {
      model_->lens.LosePower();
    } else if (kind == 9) {
      rig_->Interrupt();
    } else {
      model_->plugged = false;
    }
  }

  void Judge(const Result<rig::MoveOutcome>& end, Axis axis, bool home, double target) {
    const auto& motor = model_->lens.motor(ModelAxis(axis));
    const Instant now = clock_.Now();
    if (!end) {
      ++errors;
    } else if (!end->reached) {
      ++not_reached;
      EXPECT_NE(end->reason, "");
    } else {
      ++reached;
      const double within = axis == Axis::Filter ? 0.0 : 1.0;  // the rig's default tolerance
      const bool there =
          !motor.Busy(now) && (home ? !motor.NeedsHome(now) : std::abs(motor.Position(now) - target) <= within);
      if (!there) {
        ++false_reached;
        std::printf("falsely reached: %s %s, target %g, truly %d, busy %d, needs home %d; last fault %d, %.3f ms ago\n",
                    std::string(AxisName(axis)).c_str(), home ? "home" : "move", target, motor.Position(now),
                    motor.Busy(now), motor.NeedsHome(now), last_fault_,
                    std::chrono::duration<double, std::milli>(now - last_fault_at_).count());
      }
    }
  }

  /// What cannot heal by itself is put right; a vanished lens is opened anew.
  void CalmDown() {
    model_->lens.EndFaults();
    if (model_->plugged) return;
    model_->plugged = true;
    rig_.reset();
    Open();
  }

  std::mt19937 random_;
  int last_fault_ = -1;
  Instant last_fault_at_{};
  SteppedClock clock_;
  std::shared_ptr<testing::ModelLens> model_ = std::make_shared<testing::ModelLens>(clock_);
  drivers::Findings findings_;
  std::unique_ptr<rig::Rig> rig_;
};

/// What stood is not believed to stand there still, only because the driver waits for another motor.
TEST(LensConnectPower, LostWhileAMotorRunsIsSeenOnAllOthersAtOnce) {
  SteppedClock clock;
  const auto model = std::make_shared<testing::ModelLens>(clock);
  drivers::Findings findings;
  auto lens = drivers::lensconnect::LensConnectLens::Open(std::make_unique<testing::ModelTransport>(model, clock), {},
                                                          "A123", findings, clock);
  ASSERT_TRUE(lens) << lens.error().message;
  const auto rests = [&](Axis axis) {
    for (int i = 0; i < 10'000; ++i) {
      const auto state = (*lens)->Read();
      if (!state || !state->axes[axis]->moving) return state.has_value();
      clock.Advance(1ms);
    }
    return false;
  };
  for (const Axis axis : {Axis::Filter, Axis::Zoom}) {
    ASSERT_TRUE((*lens)->StartHome(axis));
    ASSERT_TRUE(rests(axis));
  }
  ASSERT_TRUE((*lens)->StartMove(Axis::Filter, Native{3.0}));
  ASSERT_TRUE(rests(Axis::Filter));
  ASSERT_TRUE((*lens)->StartMove(Axis::Zoom, Native{443.0}));
  model->lens.LosePower();
  const auto state = (*lens)->Read();
  ASSERT_TRUE(state);
  EXPECT_TRUE(state->axes[Axis::Zoom]->moving) << "its end is not yet judged";
  EXPECT_EQ(state->axes[Axis::Filter]->position, Native{0.0});
  EXPECT_FALSE(state->axes[Axis::Filter]->homed);
  EXPECT_NE(state->axes[Axis::Filter]->fault, "");
}

TEST(LensConnectStorm, NoHangNoFalseReachedNoLeak) {
  const long moves = testing::ByLevel(200, 1000, 10'000);
  Storm storm(20);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(storm.Once());  // what is allocated once is allocated now
  const int open_files = testing::OpenFiles();
  const std::size_t memory = mallinfo2().uordblks;
  for (long i = 0; i < moves; ++i) ASSERT_TRUE(storm.Once()) << "move " << i << " never ended";
  std::printf("%ld moves, %d faults: %d reached, %d told not reached, %d errors, %d falsely reached\n", moves + 50,
              storm.faults, storm.reached, storm.not_reached, storm.errors, storm.false_reached);
  EXPECT_EQ(storm.false_reached, 0);
  EXPECT_GT(storm.reached, moves / 4) << "the storm leaves nothing to judge";
  EXPECT_GT(storm.errors + storm.not_reached, moves / 50) << "the storm is none";
  EXPECT_EQ(testing::OpenFiles(), open_files);
  EXPECT_LT(mallinfo2().uordblks, memory + 256 * 1024);
}

}  // namespace
}  // namespace lensd
