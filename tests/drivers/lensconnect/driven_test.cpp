// The driver on the simulated lens. Section numbers are those of the same fact sheet as in bytes_test.cpp.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "cp2112.h"
#include "lensconnect_lens.h"
#include "model_transport.h"
#include "registers.h"
#include "script_transport.h"

namespace lensd::drivers::lensconnect {
namespace {

using namespace std::chrono_literals;
using sim::devices::LensConnectAxis;
using sim::devices::LensConnectFault;
using testing::Script;

/// Notes the number of every report on its way.
class Noting final : public Transport {
 public:
  struct Notes {
    std::set<int> outputs, set_features, got_features;
    std::vector<int> pointers;  ///< registers asked for, in order
  };
  Noting(std::unique_ptr<Transport> inner, std::shared_ptr<Notes> notes)
      : inner_(std::move(inner)), notes_(std::move(notes)) {}
  Result<void> Write(std::span<const std::uint8_t> report) override {
    notes_->outputs.insert(report[0]);
    if (report[0] == 0x14 && report[2] == 2) notes_->pointers.push_back(report[3] << 8 | report[4]);
    return inner_->Write(report);
  }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    return inner_->Read(buffer, patience);
  }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override {
    notes_->set_features.insert(report[0]);
    return inner_->SetFeature(report);
  }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override {
    notes_->got_features.insert(buffer[0]);
    return inner_->GetFeature(buffer);
  }
  void Interrupt() override { inner_->Interrupt(); }
  void BeginCall() override { inner_->BeginCall(); }

 private:
  std::unique_ptr<Transport> inner_;
  std::shared_ptr<Notes> notes_;
};

class Driven : public ::testing::Test {
 protected:
  void Open(const Config& config = {}) {
    auto transport = std::make_unique<Noting>(std::make_unique<testing::ModelTransport>(model_, clock_), notes_);
    auto lens = LensConnectLens::Open(std::move(transport), config, "A123", findings_, clock_);
    ASSERT_TRUE(lens) << lens.error().message;
    lens_ = *std::move(lens);
  }
  AxisState State(Axis axis) {
    const auto read = lens_->Read();
    EXPECT_TRUE(read) << read.error().message;
    return read ? *read->axes[axis] : AxisState{};
  }
  AxisState Rest(Axis axis, Duration at_most = 30s) {
    const Instant until = clock_.Now() + at_most;
    AxisState state = State(axis);
    while (state.moving && clock_.Now() < until) {
      clock_.Advance(5ms);
      state = State(axis);
    }
    EXPECT_FALSE(state.moving) << "it never came to rest";
    return state;
  }
  void HomeAll() {
    for (const Axis axis : kAxes) {
      ASSERT_TRUE(lens_->StartHome(axis));
      ASSERT_TRUE(Rest(axis).homed) << AxisName(axis);
    }
  }
  sim::devices::LensConnect& model() { return model_->lens; }
  std::uint16_t TrueFocus() { return model().motor(LensConnectAxis::Focus).Position(clock_.Now()); }

  SteppedClock clock_;
  std::shared_ptr<testing::ModelLens> model_ = std::make_shared<testing::ModelLens>(clock_);
  std::shared_ptr<Noting::Notes> notes_ = std::make_shared<Noting::Notes>();
  std::unique_ptr<Lens> lens_;
  Findings findings_;
};

// Section 5, "Connect": capabilities, then what needs initialisation, then each motor's limits and speed.
TEST_F(Driven, OpensInTheOrderOfTheSheet) {
  Open();
  auto order = notes_->pointers;
  order.erase(std::ranges::unique(order).begin(), order.end());
  const std::vector<int> expected = {0x0040, 0x0044, 0x1016, 0x1018, 0x1010, 0x1000, 0x101A,
                                     0x2012, 0x2014, 0x2010, 0x2000, 0x201A, 0x3012, 0x3014,
                                     0x3010, 0x3000, 0x301A, 0x4014, 0x4010, 0x4000, 0x0010};
  EXPECT_EQ(order, expected);
  const Capabilities& can = lens_->capabilities();
  EXPECT_EQ(can.model, "Simulated LensConnect");
  EXPECT_EQ(can.serial, "A123");
  // Section 4: optical limits for zoom, mechanical ones for focus and iris, 0 to the mechanical maximum for the filter.
  EXPECT_EQ(can.axes[Axis::Zoom]->minimum.value, 100);
  EXPECT_EQ(can.axes[Axis::Zoom]->maximum.value, 3900);
  EXPECT_EQ(can.axes[Axis::Focus]->maximum.value, 4000);
  EXPECT_EQ(can.axes[Axis::Filter]->maximum.value, 3);
  EXPECT_FALSE(can.axes[Axis::Filter]->can_stop);
  EXPECT_EQ(can.axes[Axis::Focus]->speed, 2000);
}

TEST_F(Driven, OpensAmidStrayReports) {
  for (int i = 0; i < 8; ++i) model().SendUnasked({0x13, 0x02, 0x02, 0xFF, 0xFF});
  model().Spoil(LensConnectFault::StrayReply, 8);
  Open();
  EXPECT_EQ(lens_->capabilities().axes[Axis::Focus]->maximum.value, 4000);
  ASSERT_TRUE(lens_->capabilities().axes[Axis::Focus]->direction);
  EXPECT_EQ(lens_->capabilities().axes[Axis::Focus]->direction->direction, Direction::NearPositive);
}

// Section 2 and its errata: which reports may be used at all.
TEST_F(Driven, NeverTouchesTheOneTimeProgrammableArea) {
  Open();
  HomeAll();
  std::mt19937 random(7);
  for (int i = 0; i < 300; ++i) {
    model().Spoil(sim::devices::kLensConnectFaults[random() % sim::devices::kLensConnectFaults.size()], 1);
    const Axis axis = kAxes[random() % kAxes.size()];
    const auto& can = *lens_->capabilities().axes[axis];
    switch (random() % 4) {
      case 0:
        (void)lens_->StartHome(axis);
        break;
      case 1:
        (void)lens_->Stop(axis);
        break;
      default:
        (void)lens_->StartMove(axis, Native{can.minimum.value + random() % 4});
    }
    (void)lens_->Read();
    clock_.Advance(Duration(random() % 300'000'000));
  }
  lens_.reset();
  for (const int id : notes_->outputs) EXPECT_TRUE(std::set({0x10, 0x12, 0x14, 0x15, 0x17}).contains(id)) << id;
  EXPECT_EQ(notes_->set_features, std::set({0x06}));
  EXPECT_EQ(notes_->got_features, std::set({0x06}));
  EXPECT_EQ(model().forbidden(), 0);
  EXPECT_EQ(model().resets(), 0);
  EXPECT_EQ(model().overlaps(), 0) << "two motors were told to run at once";
}

// Section 5, traps: writing the current position moves nothing, so it is not written.
TEST_F(Driven, DoesNotWriteWhereItStands) {
  Open();
  HomeAll();
  const int starts = model().starts();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{2000}));
  EXPECT_FALSE(State(Axis::Focus).moving);
  EXPECT_EQ(model().starts(), starts);
}

// Section 5, traps: a short move is over before busy is first looked at.
TEST_F(Driven, AShortMoveIsDone) {
  Open();
  HomeAll();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{2001}));
  clock_.Advance(50ms);
  const AxisState state = State(Axis::Focus);
  EXPECT_FALSE(state.moving);
  EXPECT_EQ(state.position.value, 2001);
  EXPECT_EQ(state.fault, "");
}

TEST_F(Driven, RefusesToMoveBeforeHoming) {
  Open();
  const auto moved = lens_->StartMove(Axis::Focus, Native{1000});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, Code::NotHomed);
  EXPECT_FALSE(State(Axis::Focus).homed);
}

TEST_F(Driven, ACommandMissedOnceIsGivenAgain) {
  Open();
  HomeAll();
  model().Spoil(LensConnectFault::Ignored, 1);
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{1000}));
  EXPECT_TRUE(State(Axis::Focus).moving);
  EXPECT_EQ(Rest(Axis::Focus).position.value, 1000);
  EXPECT_EQ(State(Axis::Focus).fault, "");
}

TEST_F(Driven, ACommandThatIsAlwaysMissedIsAFault) {
  Open();
  HomeAll();
  model().Spoil(LensConnectFault::Ignored, 100);
  const int starts = model().starts();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{1000}));
  const AxisState state = Rest(Axis::Focus, 5s);
  EXPECT_NE(state.fault, "");
  EXPECT_EQ(state.position.value, 2000);
  EXPECT_EQ(model().starts() - starts, 2);
  ASSERT_TRUE(lens_->StartHome(Axis::Iris));
  EXPECT_FALSE(Rest(Axis::Focus, 5s).fault.empty());
}

TEST_F(Driven, AMotorThatJamsSaysWhere) {
  Open();
  HomeAll();
  model().motor(LensConnectAxis::Focus).Jam();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{1000}));
  const AxisState state = Rest(Axis::Focus);
  EXPECT_EQ(state.position.value, 1500);
  EXPECT_EQ(state.fault, "came to rest at step 1500 instead of 1000");
}

TEST_F(Driven, MotorsRunOneAfterTheOther) {
  Open();
  HomeAll();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{0}));
  ASSERT_TRUE(lens_->StartMove(Axis::Iris, Native{600}));
  EXPECT_TRUE(State(Axis::Iris).moving);
  EXPECT_TRUE(State(Axis::Iris).waiting);
  EXPECT_EQ(Rest(Axis::Iris).position.value, 600);
  EXPECT_EQ(TrueFocus(), 0);
  EXPECT_EQ(model().overlaps(), 0);
}

TEST_F(Driven, AStopBeforeItHasBegunHoldsToo) {
  Open();
  HomeAll();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{0}));
  ASSERT_TRUE(lens_->StartMove(Axis::Iris, Native{600}));
  ASSERT_TRUE(lens_->Stop(Axis::Iris));
  ASSERT_TRUE(lens_->Stop(Axis::Focus));
  const AxisState state = Rest(Axis::Focus);
  EXPECT_GT(state.position.value, 1900);
  EXPECT_EQ(state.fault, "");
  clock_.Advance(10s);
  EXPECT_EQ(Rest(Axis::Iris).position.value, 0);
}

TEST_F(Driven, AStopThatIsIgnoredIsTold) {
  sim::devices::LensConnectTraits traits;
  for (auto& motor : traits.motors) motor.can_stop = false;
  model_ = std::make_shared<testing::ModelLens>(clock_, traits);
  Open();
  HomeAll();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{0}));
  EXPECT_TRUE(State(Axis::Focus).moving);
  ASSERT_TRUE(lens_->Stop(Axis::Focus));
  clock_.Advance(600ms);
  EXPECT_NE(State(Axis::Focus).fault.find("stop_value"), std::string::npos);
}

TEST_F(Driven, WithoutAStopValueItCannotStop) {
  Open({.stop_value = 0, .backlash_cancel = {}, .speed = {}});
  HomeAll();
  ASSERT_TRUE(lens_->StartMove(Axis::Focus, Native{0}));
  const auto stopped = lens_->Stop(Axis::Focus);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Code::Unsupported);
}

TEST_F(Driven, SpeedIsSetAndCheckedAgainstTheLens) {
  Config config;
  config.speed[Axis::Focus] = 8000;
  Open(config);
  EXPECT_EQ(lens_->capabilities().axes[Axis::Focus]->speed, 8000);
  lens_.reset();
  config.speed[Axis::Focus] = 9000;
  auto transport = std::make_unique<testing::ModelTransport>(model_, clock_);
  const auto lens = LensConnectLens::Open(std::move(transport), config, "A123", findings_, clock_);
  ASSERT_FALSE(lens);
  EXPECT_EQ(lens.error().code, Code::OutOfRange);
  EXPECT_NE(lens.error().message.find("100 to 8000"), std::string::npos);
}

// Section 3: the sign of iris and zoom is not confirmed.
TEST_F(Driven, AReversedIrisCountsFromItsOtherEnd) {
  Config config;
  config.iris_reversed = true;
  Open(config);
  HomeAll();
  EXPECT_EQ(State(Axis::Iris).position.value, 600);  // homes to its own step 0
  ASSERT_TRUE(lens_->StartMove(Axis::Iris, Native{500}));
  EXPECT_EQ(Rest(Axis::Iris).position.value, 500);
  EXPECT_EQ(model().motor(LensConnectAxis::Iris).Position(clock_.Now()), 100);
}

TEST_F(Driven, TellsItsTemperature) {
  Open();
  const auto read = lens_->Read();
  ASSERT_TRUE(read && read->temperature);
  EXPECT_NEAR(read->temperature->value, 24.85, 1e-9);  // 298 K
}

TEST_F(Driven, LosingPowerLosesTheReference) {
  Open();
  HomeAll();
  EXPECT_TRUE(State(Axis::Focus).homed);
  model().LosePower();
  clock_.Advance(1s);
  const AxisState state = State(Axis::Focus);
  EXPECT_FALSE(state.homed);
  EXPECT_NE(state.fault, "");
  EXPECT_FALSE(lens_->StartMove(Axis::Focus, Native{1000}));
}

}  // namespace
}  // namespace lensd::drivers::lensconnect
