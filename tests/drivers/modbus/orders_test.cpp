// What a drive is told, and what it says of that: a reference that is missing, a reading that makes way for a stop.
#include <gtest/gtest.h>

#include <thread>

#include "modbus_bench.h"

namespace lensd::drivers::modbus {
namespace {

using sim::WireFault;
using std::chrono::milliseconds;

class ModbusOrders : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Wire, ModbusOrders, ::testing::Bool(),
                         [](const auto& serial) { return serial.param ? "Rtu" : "Tcp"; });

TEST_P(ModbusOrders, WhereTheDriveMissesItsReferenceItIsHomedAndNotReset) {
  Bench bench(GetParam(), {"oriental-az"});
  auto device = bench.Open(FastAz("focus", 1) + "homing = \"not-needed\"\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  Lens& lens = *device->lens;
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{100}).has_value());
  ASSERT_TRUE(bench.Until(lens, Axis::Focus,
                          [](const AxisState& state) { return state.fault.find("0x4A") != std::string::npos; }));
  const auto moved = lens.StartMove(Axis::Focus, Native{100});
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, Code::NotHomed) << moved.error().message;
  EXPECT_NE(moved.error().message.find("home it first (alarm 0x4A"), std::string::npos) << moved.error().message;
  ASSERT_TRUE(bench.Home(lens, Axis::Focus));
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{100}).has_value());
  EXPECT_TRUE(bench.Until(lens, Axis::Focus,
                          [](const AxisState& state) { return !state.moving && state.position.value == 100; }));
  // Any other alarm is nothing that homing cures.
  bench.Alarm(1, 0x30);
  const auto homed = lens.StartHome(Axis::Focus);
  ASSERT_FALSE(homed.has_value());
  EXPECT_EQ(homed.error().code, Code::Unsupported);
}

TEST_P(ModbusOrders, AReadThatIsCutShortLetsAStopPass) {
  Bench bench(GetParam(), {"oriental-az"});
  auto device = bench.Open(FastAz("focus", 1), "response_timeout_ms = 2000");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  Lens& lens = *device->lens;
  ASSERT_TRUE(lens.Read().has_value());
  bench.wire.SetLate(milliseconds(1000));
  bench.wire.Inject(WireFault::Late);
  const Instant begin = bench.clock.Now();
  std::thread cutter([&] {
    std::this_thread::sleep_for(milliseconds(50));
    lens.CutReadShort();
  });
  const auto read = lens.Read();
  const Duration took = bench.clock.Now() - begin;
  cutter.join();
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, Code::Cancelled);
  EXPECT_LT(took, milliseconds(1000)) << "the first of the two answers takes that long";
  EXPECT_TRUE(lens.Stop(Axis::Focus).has_value()) << "what cuts a reading short leaves all else alone";
  EXPECT_TRUE(lens.Read().has_value());
}

}  // namespace
}  // namespace lensd::drivers::modbus
