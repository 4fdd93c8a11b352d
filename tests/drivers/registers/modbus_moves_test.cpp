// Ten thousand moves of drives whose position and status registers echo and lag, through the driver modbus: none is
// said to be there that is not, and nobody else is blamed.
#include <gtest/gtest.h>

#include <array>

#include "drawn_moves.h"
#include "drive_lens.h"
#include "test_level.h"

namespace lensd {
namespace {

using testing::RegisterDevice;

/// The wire to a drive of the profile "generic", by the addresses of its file.
class Wire final : public drivers::modbus::RegisterAccess {
 public:
  Wire(RegisterDevice& device, SteppedClock& clock, std::mt19937_64& random)
      : device_(device), clock_(clock), random_(random) {}

  Result<void> Read(std::uint16_t address, std::span<std::uint16_t> registers) override {
    Pass();
    const auto place = static_cast<std::uint32_t>(static_cast<std::int64_t>(device_.PositionRegister(clock_.Now())));
    const bool busy = device_.BusyRegister(clock_.Now());
    for (std::size_t i = 0; i < registers.size(); ++i) {
      const auto at = static_cast<std::uint16_t>(address + i);
      registers[i] = at == 2    ? static_cast<std::uint16_t>(place >> 16)
                     : at == 3  ? static_cast<std::uint16_t>(place & 0xFFFF)
                     : at == 10 ? static_cast<std::uint16_t>((busy ? 1 : 2) | 8)
                                : 0;
    }
    return {};
  }
  Result<void> Write(int, std::uint16_t address, std::span<const std::uint16_t> registers) override {
    Pass();
    for (std::size_t i = 0; i < registers.size(); ++i) written_.at(address + i) = registers[i];
    const auto target = static_cast<std::int32_t>(static_cast<std::uint32_t>(written_[0]) << 16 | written_[1]);
    if (address == 5) device_.Write(target, clock_.Now());
    if (address == 7) device_.Stop(clock_.Now());
    return {};
  }
  bool suspect() const override { return false; }

 private:
  void Pass() { clock_.Advance(std::chrono::microseconds(std::uniform_int_distribution(100, 1500)(random_))); }

  RegisterDevice& device_;
  SteppedClock& clock_;
  std::mt19937_64& random_;
  std::array<std::uint16_t, 32> written_{};
};

std::unique_ptr<drivers::Lens> MakeDrive(RegisterDevice& device, SteppedClock& clock, std::mt19937_64& random) {
  auto config = testing::GenericDrive(device.kind().range);
  if (std::uniform_int_distribution(0, 1)(random) == 1) config.profile.stop_to_retarget = false;
  return std::make_unique<testing::DriveLens<Wire>>(config, std::make_unique<Wire>(device, clock, random), clock);
}

}  // namespace

TEST(ModbusRegisters, NothingIsReachedThatIsNotThereAndNobodyElseIsBlamed) {
  auto tally = testing::RunDrawnMoves(MakeDrive, testing::ByLevel(60, 300, 10000), 1);
  Print("modbus", tally);
  EXPECT_EQ(tally.false_reached, 0);
  // Registers that lie right after a stop, or near zero as after a loss of power, cannot always be told from the truth.
  EXPECT_LE(tally.false_external, tally.moves / 4000);
  EXPECT_LE(tally.failed, tally.moves / 250);
  EXPECT_EQ(tally.hung, 0);
}

TEST(ModbusRegisters, WhatSaysTheTruthIsBelievedSoon) {
  auto tally = testing::RunTruthfulMoves(MakeDrive, testing::ByLevel(60, 200, 2000), 2);
  Print("modbus", tally);
  EXPECT_EQ(tally.reached, tally.moves);
  std::ranges::sort(tally.late_ms);
  EXPECT_LT(tally.late_ms.at(tally.late_ms.size() / 2), 10.0);
}

}  // namespace lensd
