// Ten thousand moves of GenICam lenses whose position and status features echo and lag, through the driver aravis: none
// is said to be there that is not, and nobody else is blamed. The camera's functions are this test's own.
#include <arv.h>
#include <gtest/gtest.h>

#include <string_view>

#include "aravis_lens.h"
#include "drawn_moves.h"
#include "test_level.h"

namespace lensd {
namespace {

using drivers::Axis;
using testing::DeviceKind;
using testing::RegisterDevice;

/// What stands behind the pointer that the driver has for a camera.
struct Camera {
  RegisterDevice& device;
  SteppedClock& clock;
  std::mt19937_64& random;

  static Camera& Of(ArvCamera* camera) {
    auto& found = *reinterpret_cast<Camera*>(camera);
    found.clock.Advance(std::chrono::microseconds(std::uniform_int_distribution(100, 1500)(found.random)));
    return found;
  }
};

class ControlLens final : public drivers::Lens {
 public:
  ControlLens(drivers::aravis::LensFacts facts, Camera camera)
      : Lens(Can(facts)), camera_(camera), control_(std::move(facts), camera.clock) {}

 private:
  static drivers::Capabilities Can(const drivers::aravis::LensFacts& facts) {
    drivers::Capabilities can{.driver = "aravis", .model = "drawn", .serial = "1", .axes = {}};
    can.axes[Axis::Focus] = facts.axes[Axis::Focus]->can;
    return can;
  }
  ArvCamera* camera() { return reinterpret_cast<ArvCamera*>(&camera_); }
  Result<void> DoStartHome(Axis axis) override { return control_.StartHome(camera(), axis); }
  Result<void> DoStartMove(Axis axis, Native target) override { return control_.StartMove(camera(), axis, target); }
  Result<drivers::LensState> DoRead() override { return control_.Read(camera(), 1); }
  Result<void> DoStop(Axis axis) override { return control_.Stop(camera(), axis); }

  Camera camera_;
  drivers::aravis::LensControl control_;
};

std::unique_ptr<drivers::Lens> MakeLens(RegisterDevice& device, SteppedClock& clock, std::mt19937_64& random) {
  drivers::aravis::LensFacts facts;
  facts.abort = "OpticControllerAbort";
  if (device.kind().busy != DeviceKind::Busy::Absent) facts.status = "OpticControllerStatus";
  facts.axes[Axis::Focus] = drivers::aravis::AxisFeature{.feature = "FocusStepper",
                                                         .is_integer = true,
                                                         .status = "",
                                                         .initialize = "",
                                                         .can = {.maximum = Native{device.kind().range}}};
  return std::make_unique<ControlLens>(std::move(facts), Camera{device, clock, random});
}

}  // namespace

TEST(AravisRegisters, NothingIsReachedThatIsNotThereAndNobodyElseIsBlamed) {
  auto tally = testing::RunDrawnMoves(MakeLens, testing::ByLevel(60, 300, 10000), 3);
  Print("aravis", tally);
  EXPECT_EQ(tally.false_reached, 0);
  // Registers that lie right after a stop, or near zero as after a loss of power, cannot always be told from the truth.
  EXPECT_LE(tally.false_external, tally.moves / 4000);
  EXPECT_LE(tally.failed, tally.moves / 250);
  EXPECT_EQ(tally.hung, 0);
}

TEST(AravisRegisters, WhatSaysTheTruthIsBelievedSoon) {
  auto tally = testing::RunTruthfulMoves(MakeLens, testing::ByLevel(60, 200, 2000), 4);
  Print("aravis", tally);
  EXPECT_EQ(tally.reached, tally.moves);
  std::ranges::sort(tally.late_ms);
  EXPECT_LT(tally.late_ms.at(tally.late_ms.size() / 2), 10.0);
}

}  // namespace lensd

// ---- in the place of libaravis --------------------------------------------------------------------------------------

extern "C" {

void arv_camera_set_integer(ArvCamera* camera, const char*, gint64 value, GError**) {
  auto& there = lensd::Camera::Of(camera);
  there.device.Write(static_cast<double>(value), there.clock.Now());
}

gint64 arv_camera_get_integer(ArvCamera* camera, const char*, GError**) {
  auto& there = lensd::Camera::Of(camera);
  return static_cast<gint64>(there.device.PositionRegister(there.clock.Now()));
}

const char* arv_camera_get_string(ArvCamera* camera, const char*, GError**) {
  auto& there = lensd::Camera::Of(camera);
  return there.device.BusyRegister(there.clock.Now()) ? "Busy" : "Ready";
}

void arv_camera_execute_command(ArvCamera* camera, const char*, GError**) {
  auto& there = lensd::Camera::Of(camera);
  there.device.Stop(there.clock.Now());
}

}  // extern "C"
