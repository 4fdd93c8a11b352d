// One bad part costs that part: lenses with defects on random motors. Which motors are healthy is known from the draw.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>

#include "lensconnect_lens.h"
#include "model_transport.h"
#include "test_level.h"

namespace lensd::drivers::lensconnect {
namespace {

using ::testing::HasSubstr;

/// Registers that read as another number each time.
class Unsteady final : public Transport {
 public:
  Unsteady(std::unique_ptr<Transport> inner, std::set<std::uint16_t> registers)
      : inner_(std::move(inner)), registers_(std::move(registers)) {}

  Result<void> Write(std::span<const std::uint8_t> report) override {
    // A write of two bytes to the lens says which register is read next.
    if (report.size() >= 5 && report[0] == 0x14 && report[2] == 2) {
      pointer_ = static_cast<std::uint16_t>(report[3] << 8 | report[4]);
    }
    return inner_->Write(report);
  }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    auto read = inner_->Read(buffer, patience);
    if (read && *read >= 5 && buffer[0] == 0x13 && registers_.contains(pointer_)) buffer[4] = ++noise_;
    return read;
  }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override { return inner_->SetFeature(report); }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override { return inner_->GetFeature(buffer); }
  void Interrupt() override { inner_->Interrupt(); }
  void BeginCall() override { inner_->BeginCall(); }

 private:
  const std::unique_ptr<Transport> inner_;
  const std::set<std::uint16_t> registers_;
  std::uint16_t pointer_ = 0;
  std::uint8_t noise_ = 0;
};

enum class Health { Absent, Healthy, Ill };

void PlayOne(unsigned seed) {
  std::mt19937 random(seed);
  const auto below = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  constexpr std::array kInOrder = {Axis::Zoom, Axis::Focus, Axis::Iris, Axis::Filter};  // as the model has them
  sim::devices::LensConnectTraits traits;
  std::set<std::uint16_t> unsteady;
  PerAxis<Health> health;
  std::string drawn;
  for (std::size_t i = 0; i < kInOrder.size(); ++i) {
    const Axis axis = kInOrder[i];
    health[axis] = std::array{Health::Absent, Health::Healthy, Health::Ill, Health::Ill}[random() % 4];
    auto& motor = traits.motors[i];
    motor.present = health[axis] != Health::Absent;
    if (health[axis] != Health::Ill) continue;
    drawn += " " + std::string(AxisName(axis));
    const auto base = static_cast<std::uint16_t>(0x1000 * (i + 1));
    const int defect = below(3);
    drawn += defect == 0 ? "=unsteady" : defect == 1 ? "=fixed" : "=reversed";
    if (defect == 0) {
      unsteady.insert(base + (axis == Axis::Zoom ? address::kOpticalMaximum : address::kMechanicalMaximum));
    } else if (axis == Axis::Filter) {
      motor.mechanical_maximum = 0;
    } else if (axis == Axis::Zoom) {
      motor.optical_minimum = static_cast<std::uint16_t>(motor.optical_maximum + (defect == 1 ? 0 : 1 + below(50)));
    } else {
      motor.mechanical_minimum =
          static_cast<std::uint16_t>(motor.mechanical_maximum + (defect == 1 ? 0 : 1 + below(50)));
    }
  }
  SCOPED_TRACE("seed " + std::to_string(seed) + ":" + drawn);
  SteppedClock clock;
  const auto model = std::make_shared<lensd::testing::ModelLens>(clock, traits);
  Findings findings;
  auto transport = std::make_unique<Unsteady>(std::make_unique<lensd::testing::ModelTransport>(model, clock), unsteady);
  const auto lens = LensConnectLens::Open(std::move(transport), {}, "A123", findings, clock);
  const bool any = std::ranges::any_of(kAxes, [&](Axis axis) { return health[axis] == Health::Healthy; });
  ASSERT_EQ(lens.has_value(), any) << (lens ? "" : lens.error().message);
  for (const Axis axis : kAxes) {
    SCOPED_TRACE(std::string(AxisName(axis)));
    EXPECT_EQ(findings.Of(AxisName(axis)) != nullptr, health[axis] == Health::Ill);
    if (!lens && health[axis] == Health::Ill) {
      EXPECT_THAT(lens.error().message, HasSubstr(std::string(AxisName(axis)) + " ("));
    }
    if (!lens) continue;
    EXPECT_EQ((*lens)->capabilities().axes[axis].has_value(), health[axis] == Health::Healthy);
    if (health[axis] != Health::Healthy) continue;
    EXPECT_TRUE((*lens)->StartHome(axis).has_value());
    for (int i = 0; i < 20'000; ++i) {
      const auto state = (*lens)->Read();
      ASSERT_TRUE(state.has_value()) << state.error().message;
      if (!state->axes[axis]->moving) break;
      clock.Advance(std::chrono::milliseconds(5));
    }
    EXPECT_TRUE((*lens)->Read()->axes[axis]->homed);
  }
}

TEST(LensConnectParts, DrawnDefectsCostTheMotorsThatHaveThem) {
  const long count = lensd::testing::ByLevel(50, 300, 100'000);
  for (long i = 0; i < count && !::testing::Test::HasFailure(); ++i) PlayOne(static_cast<unsigned>(i));
}

/// A motor that a key names is not left out.
TEST(LensConnectParts, WhatTheConfigurationNamesIsAnError) {
  SteppedClock clock;
  sim::devices::LensConnectTraits traits;
  traits.motors[2].mechanical_minimum = 700;  // of the iris, above its maximum
  const auto model = std::make_shared<lensd::testing::ModelLens>(clock, traits);
  Findings findings;
  Config config;
  config.speed[Axis::Iris] = 1000;
  const auto lens = LensConnectLens::Open(std::make_unique<lensd::testing::ModelTransport>(model, clock), config,
                                          "A123", findings, clock);
  ASSERT_FALSE(lens.has_value());
  EXPECT_THAT(lens.error().message, HasSubstr("iris goes from 700 to 600"));
}

}  // namespace
}  // namespace lensd::drivers::lensconnect
