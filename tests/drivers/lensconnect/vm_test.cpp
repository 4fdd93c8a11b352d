// In the virtual machine: the driver through hidapi, the kernel's hidraw and hid-generic, on a simulated lens that
// hangs on uhid. Order and state are asserted, never time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "drivers/hotplug/nodes.h"
#include "drivers/lensconnect/driver.h"
#include "open_files.h"
#include "resident_memory.h"
#include "rig/rig.h"
#include "sim/devices/lensconnect_uhid.h"
#include "stand.h"
#include "test_level.h"

namespace lensd {
namespace {

using namespace std::chrono_literals;
using drivers::Axis;
using sim::devices::LensConnect;
using sim::devices::LensConnectAxis;
using sim::devices::LensConnectFault;
using sim::devices::LensConnectUhid;

constexpr const char* kSerial = "VM123";

sim::devices::LensConnectTraits QuickLens() {
  sim::devices::LensConnectTraits traits;
  for (auto& motor : traits.motors) {
    motor.speed = motor.speed_maximum = 20000;
    motor.home_position = motor.mechanical_minimum;
  }
  traits.motors[3].speed = 100;
  traits.busy_polls = 0;
  return traits;
}

Settings Wanted(const std::string& serial) {
  Settings::Table table;
  table.emplace("serial", Settings(serial, {}));
  table.emplace("start_timeout_ms", Settings(std::int64_t{150}, {}));
  return Settings(std::move(table), {"vm_test.toml", 1});
}

/// The kernel makes the node a little later, and takes it away a little later.
void AwaitNode(bool there) {
  for (int i = 0; i < 20'000; ++i) {
    const auto nodes = drivers::hotplug::ListNodes("hidraw");
    ASSERT_TRUE(nodes) << nodes.error().message;
    const bool found = std::ranges::any_of(*nodes, [](const auto& node) { return node.serial == kSerial; });
    if (found == there) return;
    std::this_thread::sleep_for(1ms);
  }
  FAIL() << "the hidraw node did not " << (there ? "appear" : "vanish");
}

LensConnectAxis ModelAxis(Axis axis) {
  return axis == Axis::Focus  ? LensConnectAxis::Focus
         : axis == Axis::Iris ? LensConnectAxis::Iris
         : axis == Axis::Zoom ? LensConnectAxis::Zoom
                              : LensConnectAxis::Filter;
}

class UhidStand final : public contract::RealStand {
 public:
  UhidStand() { Plug(); }
  Result<drivers::Device> Open() override { return drivers::lensconnect::OpenLensConnect(Wanted(kSerial), clock()); }
  bool Unplug() override {
    lens_.Unplug();
    return true;
  }
  void Plug() override {
    const auto plugged = lens_.Plug();
    ASSERT_TRUE(plugged) << plugged.error().message;
    AwaitNode(true);
  }

 private:
  LensConnectUhid lens_{QuickLens(), kSerial};
};

INSTANTIATE_TEST_SUITE_P(LensConnectUhid, LensContract, contract::Stands<UhidStand>());

class InTheMachine : public ::testing::Test {
 protected:
  void SetUp() override { Plug(); }
  void TearDown() override { lens_.Unplug(); }
  void Plug() {
    const auto plugged = lens_.Plug();
    ASSERT_TRUE(plugged) << plugged.error().message;
    AwaitNode(true);
  }
  void Open() {
    auto device = drivers::lensconnect::OpenLensConnect(Wanted(kSerial), clock_);
    ASSERT_TRUE(device) << device.error().message;
    auto rig = rig::Rig::Create({}, *std::move(device), clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = *std::move(rig);
  }
  /// Steps the rig until the motion has ended. None: it never did.
  std::optional<Result<rig::MoveOutcome>> Run(
      const std::function<void(rig::MoveCallback)>& begin, const std::function<void()>& meanwhile = [] {}) {
    std::optional<Result<rig::MoveOutcome>> end;
    begin([&](Result<rig::MoveOutcome> outcome) { end = std::move(outcome); });
    const Instant until = clock_.Now() + 120s;
    while (!end && clock_.Now() < until) {
      rig_->Step(clock_.Now());
      meanwhile();
      std::this_thread::sleep_for(500us);
    }
    return end;
  }
  std::optional<Result<rig::MoveOutcome>> Move(
      Axis axis, double target, const std::function<void()>& meanwhile = [] {}) {
    return Run(
        [&](rig::MoveCallback done) {
          rig_->Move(axis, {.kind = rig::Target::Kind::Native, .value = target, .from = {}}, std::move(done));
        },
        meanwhile);
  }
  std::optional<Result<rig::MoveOutcome>> Home(Axis axis) {
    return Run([&](rig::MoveCallback done) { rig_->Home(axis, std::move(done)); });
  }
  void HomeAll() {
    for (const Axis axis : drivers::kAxes) {
      const auto homed = Home(axis);
      ASSERT_TRUE(homed && *homed) << AxisName(axis) << ": " << (homed ? homed->error().message : "it never ended");
      ASSERT_TRUE((*homed)->reached) << (*homed)->reason;
    }
  }
  double TruePosition(Axis axis) {
    double position = 0.0;
    lens_.With([&](LensConnect& lens) { position = lens.motor(ModelAxis(axis)).Position(clock_.Now()); });
    return position;
  }

  MonotonicClock clock_;
  LensConnectUhid lens_{QuickLens(), kSerial};
  std::unique_ptr<rig::Rig> rig_;
};

TEST_F(InTheMachine, IsFoundWithItsConfigurationLines) {
  const auto found = drivers::lensconnect::ProbeLensConnect();
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->front().serial, kSerial);
  EXPECT_EQ(found->front().model, "Computar LensConnect");
  EXPECT_EQ(found->front().config, "serial = \"VM123\"\n");
  EXPECT_EQ(found->front().problem, "");
  EXPECT_TRUE(found->front().lens);
}

TEST_F(InTheMachine, HomesAndMovesAllAxes) {
  Open();
  HomeAll();
  for (const Axis axis : drivers::kAxes) {
    const auto [low, high] = rig_->SoftLimits(axis);
    for (const Native target : {high, low}) {
      const auto moved = Move(axis, target.value);
      ASSERT_TRUE(moved && *moved) << AxisName(axis);
      EXPECT_TRUE((*moved)->reached && !(*moved)->verified) << (*moved)->reason;
      EXPECT_EQ(TruePosition(axis), target.value);
    }
  }
  lens_.With([](LensConnect& lens) { EXPECT_EQ(lens.forbidden() + lens.overlaps() + lens.resets(), 0); });
}

TEST_F(InTheMachine, SurvivesEachFault) {
  Open();
  HomeAll();
  double target = 0.0;
  for (const LensConnectFault fault : sim::devices::kLensConnectFaults) {
    for (const int count : {1, 3, 50}) {
      SCOPED_TRACE("fault " + std::to_string(static_cast<int>(fault)) + ", " + std::to_string(count) + " times");
      target = target == 0.0 ? 2000.0 : 0.0;
      lens_.With([&](LensConnect& lens) { lens.Spoil(fault, count); });
      const auto moved = Move(Axis::Focus, target);
      ASSERT_TRUE(moved) << "the move never ended";
      if (*moved && (*moved)->reached) {
        EXPECT_NEAR(TruePosition(Axis::Focus), target, 1.0);
      }

      lens_.With([](LensConnect& lens) { lens.EndFaults(); });
      const auto after = Move(Axis::Focus, 1000.0);
      ASSERT_TRUE(after && *after) << (after ? after->error().message : "it never ended");
      EXPECT_TRUE((*after)->reached) << (*after)->reason << "; before: "
                                     << (*moved ? (*moved)->reason : moved->error().message);
      EXPECT_EQ(TruePosition(Axis::Focus), 1000.0);
    }
  }
}

TEST_F(InTheMachine, UnpluggedInMidMoveIsDisconnected) {
  Open();
  HomeAll();
  bool unplugged = false;
  const auto moved = Move(Axis::Focus, 4000.0, [&] {
    if (!unplugged && TruePosition(Axis::Focus) > 100.0) {
      lens_.Unplug();
      unplugged = true;
    }
  });
  ASSERT_TRUE(moved && unplugged);
  ASSERT_FALSE(*moved);
  EXPECT_EQ(moved->error().code, Code::Disconnected) << moved->error().message;
  EXPECT_FALSE(rig_->GetStatus().connected);
  rig_.reset();
  AwaitNode(false);
  const auto gone = drivers::lensconnect::OpenLensConnect(Wanted(kSerial), clock_);
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, Code::Disconnected);
}

TEST_F(InTheMachine, MovesInAStormOfFaults) {
  Open();
  HomeAll();
  std::mt19937 random(300);
  int files = 0;
  long resident = 0;
  int reached = 0, not_reached = 0, errors = 0;
  const long moves = testing::ByLevel(30, 50, 300);
  for (long i = 0; i < moves; ++i) {
    if (i == moves / 4) {
      files = testing::OpenFiles();
      resident = testing::ResidentKilobytes();
    }
    const Axis axis = drivers::kAxes[random() % drivers::kAxes.size()];
    const auto [low, high] = rig_->SoftLimits(axis);
    const double target = low.value + static_cast<double>(random() % static_cast<unsigned>((high - low).value + 1));
    lens_.With([&](LensConnect& lens) {
      const auto kind = random() % (sim::devices::kLensConnectFaults.size() + 1);
      if (kind < sim::devices::kLensConnectFaults.size()) {
        lens.Spoil(sim::devices::kLensConnectFaults[kind], 1 + static_cast<int>(random() % 4));
      } else {
        lens.motor(ModelAxis(axis)).Jam();
      }
    });
    const auto moved = Move(axis, target);
    ASSERT_TRUE(moved) << "move " << i << " never ended";
    if (!*moved) {
      ++errors;
    } else if (!(*moved)->reached) {
      ++not_reached;
    } else {
      ++reached;
      ASSERT_NEAR(TruePosition(axis), target, axis == Axis::Filter ? 0.0 : 1.0) << "falsely reached, move " << i;
    }
    lens_.With([](LensConnect& lens) { lens.EndFaults(); });
  }
  std::printf("%ld moves: %d reached, %d told not reached, %d errors, none falsely\n", moves, reached, not_reached,
              errors);
  EXPECT_GT(reached, moves / 3);
  EXPECT_EQ(testing::OpenFiles(), files);
  EXPECT_LT(testing::ResidentKilobytes() - resident, 4096);
}

}  // namespace
}  // namespace lensd
