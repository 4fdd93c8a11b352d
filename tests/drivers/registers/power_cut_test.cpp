// Drives of the profile "generic" that lose their power for a moment and keep saying that they are homed: they count
// from zero, or nearly, where they stand. Nothing is reached that is elsewhere, and no other program is blamed.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>
#include <optional>
#include <random>

#include "drive_lens.h"
#include "register_device.h"
#include "rig/rig.h"
#include "test_level.h"

namespace lensd {
namespace {

using drivers::Axis;

constexpr double kBase = 2e9;  ///< the shaft's place where the drive counts from, at first: it turns either way

/// What the cut leaves in the drive, and what the bus sees of it.
struct PowerCut {
  double zero = kBase;  ///< the shaft's place where the drive counts 0
  int unanswered = 0;   ///< the next so many questions fail
  Code says = Code::Timeout;
};

class CutWire final : public drivers::modbus::RegisterAccess {
 public:
  CutWire(PowerCut& cut, testing::RegisterDevice& device, SteppedClock& clock)
      : cut_(cut), device_(device), clock_(clock) {}

  Result<void> Read(std::uint16_t address, std::span<std::uint16_t> registers) override {
    if (auto fails = Fails()) return PassOn(*fails);
    const auto place =
        static_cast<std::uint32_t>(static_cast<std::int64_t>(device_.PositionRegister(clock_.Now()) - cut_.zero));
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
    if (auto fails = Fails()) return PassOn(*fails);
    for (std::size_t i = 0; i < registers.size(); ++i) written_.at(address + i) = registers[i];
    const auto target = static_cast<std::int32_t>(static_cast<std::uint32_t>(written_[0]) << 16 | written_[1]);
    if (address == 5) device_.Write(cut_.zero + target, clock_.Now());
    if (address == 7) device_.Stop(clock_.Now());
    return {};
  }
  bool suspect() const override { return false; }

 private:
  std::optional<Error> Fails() {
    clock_.Advance(std::chrono::milliseconds(1));
    if (cut_.unanswered == 0) return std::nullopt;
    --cut_.unanswered;
    clock_.Advance(std::chrono::milliseconds(cut_.says == Code::Timeout ? 60 : 0));
    return Error{cut_.says, "no power"};
  }

  PowerCut& cut_;
  testing::RegisterDevice& device_;
  SteppedClock& clock_;
  std::array<std::uint16_t, 32> written_{};
};

struct PowerCutTally {
  int cuts = 0, refused = 0, unknown = 0, false_reached = 0, false_external = 0, hung = 0;
};

class CutDrive {
 public:
  CutDrive(std::mt19937_64& random, PowerCutTally& tally) : random_(random), tally_(tally) {
    clock_.Advance(std::chrono::hours(1));
    testing::DeviceKind kind;
    kind.range = 4e9;
    kind.speed = std::exp(Uniform(std::log(500.0), std::log(40e3)));
    kind.busy = Uniform(0, 1) < 0.3 ? testing::DeviceKind::Busy::Absent : testing::DeviceKind::Busy::True;
    device_.emplace(kind, random_);
    device_->Write(kBase, clock_.Now());
    clock_.Advance(std::chrono::hours(2000));
    auto config = testing::GenericDrive(20e3);
    config.low = -20e3;
    rig::RigConfig rig_config;
    if (speed_known_ = Uniform(0, 1) < 0.5; speed_known_) rig_config.axes[Axis::Focus].speed = kind.speed;
    drivers::Device opened;
    opened.lens = std::make_unique<testing::DriveLens<CutWire>>(
        config, std::make_unique<CutWire>(cut_, *device_, clock_), clock_);
    rig_ = rig::Rig::Create(rig_config, std::move(opened), clock_).value();
  }

  void Play() {
    ++tally_.cuts;
    stood_ = Place();
    Move(stood_);
    Idle(Uniform(0, 1) < 0.3 ? 0.0 : Uniform(0.0, 1500.0));
    // A drive that is sent to zero and says zero is there for all that anybody can see, unless it is known to be slower
    // than that: 0.8 s is what a register may lag at twice the speed.
    const double speed = device_->kind().speed;
    const bool to_zero = speed_known_ && Uniform(0, 1) < 0.4 && std::abs(stood_) > std::max(500.0, 1.5 * speed);
    const double target = to_zero ? 0.0 : Uniform(0, 1) < 0.4 ? stood_ + Near() : Place();
    if (Uniform(0, 1) < 0.5) {
      Begin(target);
      // It is not cut where it counts almost nothing.
      const double way = std::abs(target - stood_);
      const double clear = std::max(0.0, std::abs(stood_) - 200.0 - (to_zero ? 0.9 * speed : 0.0));
      Idle(1e3 * std::min(0.9 * way, clear) * Uniform(to_zero ? 0.3 : 0.0, 1.0) / speed);
      Cut(to_zero ? 0 : std::uniform_int_distribution(0, 2)(random_));
      Await();
    } else {
      Cut(std::uniform_int_distribution(0, 2)(random_));
    }
    if (Uniform(0, 1) < 0.5) Idle(Uniform(0.0, 1500.0));
    for (const double place : {target, Place()}) Move(place);
    Idle(1500.0);
    if (rig_->GetStatus().axes[Axis::Focus]->homed) {
      ++tally_.false_reached;
      ADD_FAILURE() << "its place is known";
    }
  }

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  double Place() {
    const double far = std::round(std::exp(Uniform(std::log(300.0), std::log(20e3))));
    return Uniform(0, 1) < 0.5 ? far : -far;
  }
  double Near() { return std::round(Uniform(-60.0, 60.0)); }

  /// `noticed`: not at all, by answers that are lost, by a broken link.
  void Cut(int noticed) {
    device_->Stop(clock_.Now());
    cut_.zero = std::round(device_->Shaft(clock_.Now())) - (Uniform(0, 1) < 0.4 ? 0.0 : std::round(Uniform(-3, 3)));
    cut_.unanswered = noticed == 0 ? 0 : noticed == 1 ? std::uniform_int_distribution(1, 4)(random_) : 1;
    cut_.says = noticed == 1 ? Code::Timeout : Code::Disconnected;
  }
  void Begin(double target) {
    end_.reset();
    target_ = target;
    rig_->Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
               [this](Result<rig::MoveOutcome> outcome) { end_ = std::move(outcome); });
  }
  void Move(double target) {
    Begin(target);
    Await();
  }
  void Step() {
    const Instant next = rig_->Step(clock_.Now());
    clock_.AdvanceTo(std::min(std::max(next, clock_.Now() + std::chrono::microseconds(100)),
                              clock_.Now() + std::chrono::milliseconds(20)));
    if (rig_->GetStatus().axes[Axis::Focus]->moved_by_another && tally_.false_external++ < 5) {
      ADD_FAILURE() << "blames another program";
    }
  }
  void Idle(double ms) {
    const Instant end = clock_.Now() + std::chrono::microseconds(std::lround(1e3 * ms));
    while (clock_.Now() < end) Step();
  }
  void Await() {
    const Instant limit = clock_.Now() + std::chrono::minutes(5);
    while (!end_ && clock_.Now() < limit) Step();
    if (!end_) {
      ++tally_.hung;
      const auto focus = *rig_->GetStatus().axes[Axis::Focus];
      ADD_FAILURE() << "never ended: to " << target_ << ", reads " << focus.position.value << ", moving "
                    << focus.moving << ", homed " << focus.homed << ", fault " << focus.fault << ", connected "
                    << rig_->GetStatus().connected << ", stood at " << stood_ << ", noticed by "
                    << static_cast<int>(cut_.says) << ", unanswered " << cut_.unanswered << ", speed "
                    << device_->kind().speed << ", busy " << static_cast<int>(device_->kind().busy);
    } else if (!*end_) {
      tally_.refused += end_->error().code == Code::NotHomed;
    } else {
      tally_.unknown += (*end_)->cause == rig::MoveCause::PositionUnknown;
      tally_.false_external += (*end_)->cause == rig::MoveCause::External;
      const double shaft = device_->Shaft(clock_.Now()) - kBase;
      if (!(*end_)->reached || std::abs(shaft - target_) <= 1.5) return;
      ++tally_.false_reached;
      ADD_FAILURE() << "falsely reached: " << target_ << ", the shaft is at " << shaft << ", stood at " << stood_
                    << ", speed " << device_->kind().speed << ", noticed by " << static_cast<int>(cut_.says);
    }
  }

  std::mt19937_64& random_;
  PowerCutTally& tally_;
  SteppedClock clock_;
  PowerCut cut_;
  std::optional<testing::RegisterDevice> device_;
  std::unique_ptr<rig::Rig> rig_;
  std::optional<Result<rig::MoveOutcome>> end_;
  double target_ = 0.0, stood_ = 0.0;
  bool speed_known_ = false;
};

}  // namespace

TEST(ModbusRegisters, ADriveThatLosesItsPowerIsNotWhereItSaysAndNobodyElseIsBlamed) {
  PowerCutTally tally;
  const long cuts = testing::ByLevel(40, 200, 20000);
  for (long i = 0; i < cuts && tally.false_reached < 5; ++i) {
    std::seed_seq seeds{7L, i};
    std::mt19937_64 random(seeds);
    SCOPED_TRACE(::testing::Message() << "drive " << i);
    CutDrive(random, tally).Play();
  }
  std::cout << tally.cuts << " cuts: " << tally.refused << " moves refused, " << tally.unknown
            << " with the place unknown, " << tally.false_reached << " falsely reached, " << tally.false_external
            << " falsely external, " << tally.hung << " hung\n";
  EXPECT_EQ(tally.hung, 0);
  EXPECT_EQ(tally.false_external, 0);
}

}  // namespace lensd
