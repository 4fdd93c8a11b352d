// Drives whose profile is wrong about their registers: word order, width, and counters that wrap. Nobody else is
// blamed, and what is wrong is said.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>
#include <map>

#include "drive_lens.h"
#include "register_device.h"
#include "rig/rig.h"
#include "test_level.h"

namespace lensd {
namespace {

using drivers::Axis;

enum class Wrong { Nothing, Order, Width, Wraps, Address };

/// A true drive of the profile "generic", but for what is wrong with it.
class OddWire final : public drivers::modbus::RegisterAccess {
 public:
  OddWire(Wrong wrong, testing::RegisterDevice& device, SteppedClock& clock)
      : wrong_(wrong), device_(device), clock_(clock) {}

  Result<void> Read(std::uint16_t address, std::span<std::uint16_t> registers) override {
    clock_.Advance(std::chrono::milliseconds(1));
    auto place = static_cast<std::uint32_t>(static_cast<std::int64_t>(device_.PositionRegister(clock_.Now())));
    if (wrong_ == Wrong::Wraps) place &= 0xFFFF;
    auto high = static_cast<std::uint16_t>(place >> 16), low = static_cast<std::uint16_t>(place & 0xFFFF);
    if (wrong_ == Wrong::Order) std::swap(high, low);
    if (wrong_ == Wrong::Width) {  // one register, and after it something else
      high = low;
      low = 7;
    }
    if (wrong_ == Wrong::Address) high = low = 0;
    const bool busy = device_.BusyRegister(clock_.Now());
    for (std::size_t i = 0; i < registers.size(); ++i) {
      const auto at = static_cast<std::uint16_t>(address + i);
      registers[i] = at == 2 ? high : at == 3 ? low : at == 10 ? static_cast<std::uint16_t>((busy ? 1 : 2) | 8) : 0;
    }
    return {};
  }
  Result<void> Write(int, std::uint16_t address, std::span<const std::uint16_t> registers) override {
    clock_.Advance(std::chrono::milliseconds(1));
    for (std::size_t i = 0; i < registers.size(); ++i) written_.at(address + i) = registers[i];
    if (address == 5) device_.Write(written_[0] * 65536.0 + written_[1], clock_.Now());
    if (address == 7) device_.Stop(clock_.Now());
    return {};
  }
  bool suspect() const override { return false; }

 private:
  const Wrong wrong_;
  testing::RegisterDevice& device_;
  SteppedClock& clock_;
  std::array<std::uint16_t, 32> written_{};
};

/// Moves of one such drive to drawn places; by reason, how often each was said.
std::map<std::string, long> Said(Wrong wrong, double range, std::mt19937_64& random) {
  SteppedClock clock;
  clock.Advance(std::chrono::hours(1));
  testing::DeviceKind kind;
  kind.range = 4e9;  // it goes where it is sent, wherever that is
  kind.speed = std::min(2e5, std::uniform_real_distribution(0.2, 2.0)(random) * range);
  testing::RegisterDevice device(kind, random);
  drivers::Device opened;
  opened.lens = std::make_unique<testing::DriveLens<OddWire>>(testing::GenericDrive(range),
                                                              std::make_unique<OddWire>(wrong, device, clock), clock);
  auto rig = rig::Rig::Create({}, std::move(opened), clock).value();
  std::map<std::string, long> said;
  for (int i = 0; i < 4; ++i) {
    std::optional<Result<rig::MoveOutcome>> end;
    const double target = std::round(std::uniform_real_distribution(0.0, range)(random));
    rig->Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
              [&](Result<rig::MoveOutcome> outcome) { end = std::move(outcome); });
    const Instant limit = clock.Now() + std::chrono::minutes(5);
    while (!end && clock.Now() < limit) {
      clock.AdvanceTo(std::min(rig->Step(clock.Now()), clock.Now() + std::chrono::milliseconds(20)));
      if (rig->GetStatus().axes[Axis::Focus]->moved_by_another) ++said["external"];
    }
    if (!end) {
      ++said["hung"];
    } else if (!*end) {
      ++said[end->error().message];
    } else if ((*end)->reached) {
      ++said[std::abs(device.Shaft(clock.Now()) - target) <= 1.0 ? "reached" : "falsely reached"];
    } else {
      std::string reason = (*end)->cause == rig::MoveCause::External ? "external" : (*end)->reason;
      std::erase_if(reason, [](char letter) { return letter >= '0' && letter <= '9'; });
      ++said[reason];
      EXPECT_FALSE(device.Turns(clock.Now()))
          << (*end)->reason << ", to " << target << ", shaft at " << device.Shaft(clock.Now()) << ", speed "
          << kind.speed << ", range " << range;
    }
  }
  return said;
}

long Count(const std::map<std::string, long>& said, std::string_view words) {
  long count = 0;
  for (const auto& [reason, times] : said) count += reason.find(words) != std::string::npos ? times : 0;
  return count;
}

}  // namespace

TEST(OddPositions, AreSaidToBeWhatTheyAre) {
  std::mt19937_64 random(5);
  const long drives = testing::ByLevel(3, 10, 300);
  const std::pair<Wrong, const char*> kinds[] = {{Wrong::Nothing, ""},
                                                 {Wrong::Order, "set word_order = \"low-first\""},
                                                 {Wrong::Width, "another address or width"},
                                                 {Wrong::Wraps, "the drive's counter wraps"},
                                                 {Wrong::Address, "is [position] of its profile at the right address"}};
  for (const auto& [wrong, words] : kinds) {
    std::map<std::string, long> said;
    for (long i = 0; i < drives; ++i) {
      const double range = wrong == Wrong::Wraps ? std::uniform_real_distribution(90e3, 400e3)(random)
                                                 : std::exp(std::uniform_real_distribution(5.0, 11.0)(random));
      for (const auto& [reason, times] : Said(wrong, std::round(range), random)) said[reason] += times;
    }
    if (wrong == Wrong::Nothing) {
      EXPECT_EQ(said["reached"], 4 * drives);
    } else {
      EXPECT_GT(Count(said, words), drives / 2) << "of " << 4 * drives << ": " << words;
    }
    EXPECT_EQ(said["external"], 0);
    EXPECT_EQ(said["falsely reached"], 0) << words;
    EXPECT_EQ(said["hung"], 0);
    std::cout << "wrong " << static_cast<int>(wrong) << ": " << 4 * drives << " moves, " << said["reached"]
              << " reached, " << (words[0] ? Count(said, words) : 0) << " said so\n";
    if (HasFailure()) {
      for (const auto& [reason, times] : said) std::cout << "  " << times << " x " << reason << "\n";
    }
  }
}

}  // namespace lensd
