// Readings of a thermometer that goes wrong in every way: how far the lens moves for them is judged by where it stood
// alone, and what is believed by the readings that were given. None of that is computed as the rig does.
#include "rig/calibration/thermometer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "test_level.h"
#include "tests/rig/calibration_samples.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

constexpr double kPerDegree = 4e-6;   // metres
constexpr double kRate = 5.0;         // the default, degrees a minute
constexpr double kWorthAMove = 4e-6;  // metres; a step is 1 um, or less
constexpr double kApart = 1.0;        // degrees by which readings of one temperature may differ

/// One after the other, as a lens might tell them.
struct Told {
  Duration after;
  double value;          ///< NAN: none
  bool possible = true;  ///< within the range, and a number
};

class Readings {
 public:
  explicit Readings(std::uint64_t seed) : random_(seed) {}

  std::vector<Told> Draw() {
    std::vector<Told> told;
    true_c_ = Uniform(-10.0, 35.0);
    fine_ = Chance(0.7);
    told.push_back({1s, Measured()});
    for (int part = 0; part < 12; ++part) Part(told);
    // In the end nothing is wrong any more, for long enough that whatever was can be forgotten.
    per_minute_ = Uniform(-0.2, 0.2);
    for (int i = 0; i < 60; ++i) told.push_back(Next(30s));
    return told;
  }
  double true_c() const { return true_c_; }
  bool fine() const { return fine_; }

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  bool Chance(double of) { return Uniform(0.0, 1.0) < of; }
  double Measured() { return fine_ ? true_c_ + Uniform(-0.1, 0.1) : std::round(true_c_); }
  Duration Pause() {
    return std::chrono::duration_cast<Duration>(
        std::chrono::duration<double>(std::exp(Uniform(std::log(0.1), std::log(600.0)))));
  }
  Told Next(Duration after) {
    true_c_ += per_minute_ * std::chrono::duration<double, std::ratio<60>>(after).count();
    true_c_ = std::clamp(true_c_, -30.0, 70.0);
    return {after, Measured()};
  }
  void Part(std::vector<Told>& told) {
    const double kind = Uniform(0.0, 1.0);
    per_minute_ = Uniform(-3.0, 3.0);
    const Duration pause = Pause();
    const int count = std::uniform_int_distribution(1, 25)(random_);
    if (kind < 0.15) true_c_ = std::clamp(true_c_ + Uniform(-40.0, 40.0), -30.0, 70.0);  // carried outdoors
    const double stuck = Measured();
    constexpr double kGone[] = {-127.0, 85.0, 0.0, -273.15, INFINITY, NAN, 120.0, -40.1};
    const double gone = kGone[std::uniform_int_distribution(0, 7)(random_)];
    for (int i = 0; i < count; ++i) {
      Told next = Next(pause);
      if (kind > 0.85) {
        next.value = stuck;
      } else if (kind > 0.6) {
        next.value = gone;
      } else if (kind > 0.4 && Chance(0.2)) {
        next.value += Uniform(-60.0, 60.0);
      }
      next.possible = std::isnan(next.value) || (next.value >= -40.0 && next.value <= 80.0);
      told.push_back(next);
    }
  }

  std::mt19937_64 random_;
  double true_c_ = 20.0, per_minute_ = 0.0;
  bool fine_ = true;
};

/// A reading that is left out is named by its number; the newest one, whatever was wrong before.
void ExpectNamed(const std::string& fault, double value) {
  double named = NAN;
  const std::string words = "it reports ";
  ASSERT_EQ(fault.rfind(words, 0), 0u) << fault;
  std::istringstream(fault.substr(words.size())) >> named;
  if (std::isfinite(value)) {
    EXPECT_NEAR(named, value, 0.05 + 1e-3 * std::abs(value)) << fault;
  } else {
    EXPECT_EQ(fault, "it reports no number");
  }
}

class ThermometerRig : public RigTest {
 protected:
  void Begin() {
    auto calibration = std::make_shared<Calibration>(*With({Measured(21)}));
    calibration->serial = "1";
    calibration->temperature = TemperatureModel{Metres{kPerDegree}, Metres{}, Celsius{20}, Celsius{-40}, Celsius{80}};
    RigConfig config;
    config.temperature.compensate = true;
    config.temperature.minimum_move = 3.0;
    *controls_ = {};
    controls_->temperature_c = start_;
    rig_ = *Rig::Create(config, testing::MakeFakeDevice(clock_, controls_), clock_, calibration);
    Run(5s);
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, {.kind = Target::Kind::Extension, .value = kHeld, .from = {}, .take_up = {}}, moved.Take());
    RunUntil(moved);
    ASSERT_TRUE(moved.only() && moved.only()->reached);
  }
  /// The next reading comes so much later, and none between; what it sets going comes to its end.
  void Tell(const Told& told) {
    clock_.AdvanceTo(clock_.Now() + told.after);
    controls_->temperature_c = told.value;
    for (int i = 0; i < 3; ++i) rig_->Step(clock_.Now());
  }
  double Stands() { return TrueExtension(Focus()); }

  static constexpr double kHeld = 0.5e-3;
  double start_ = 20.0;
};

double MinutesBetween(Instant from, Instant to) {
  return std::chrono::duration<double, std::ratio<60>>(to - from).count();
}

TEST_F(ThermometerRig, NoReadingMovesTheLensFartherThanTheTemperatureCanHaveGone) {
  const int count = testing::ByLevel(20, 60, 5000);
  std::uint64_t readings = 0, left_out = 0, moves = 0;
  for (int seed = 1; seed <= count; ++seed) {
    Readings drawn(static_cast<std::uint64_t>(seed));
    const std::vector<Told> all = drawn.Draw();
    start_ = all.front().value;
    ASSERT_NO_FATAL_FAILURE(Begin());
    struct Stood {
      Instant at;  ///< of the newest reading that says what is believed
      double extension;
    };
    std::vector<Stood> stood{{clock_.Now(), Stands()}};
    Instant believed_at = clock_.Now();
    for (const Told& told : all) {
      const auto before = rig_->GetStatus();
      Tell(told);
      Run(400ms);  // shorter than it takes until the next reading of a lens that stands
      while (rig_->GetStatus().activity.kind != Activity::Kind::Idle) Run(20ms);
      const auto after = rig_->GetStatus();
      ++readings;
      if (!told.possible && after.sampled_at > before.sampled_at) {
        EXPECT_EQ(after.temperature, before.temperature) << seed;
        EXPECT_GT(after.temperatures_left_out, before.temperatures_left_out) << seed;
        ExpectNamed(after.temperature_fault, told.value);
      } else if (std::isfinite(told.value) && after.temperatures_left_out > before.temperatures_left_out) {
        ExpectNamed(after.temperature_fault, told.value);
      }
      if (after.temperature && after.temperature->value == told.value) believed_at = after.sampled_at;
      const Stood now{believed_at, Stands()};
      if (now.extension != stood.back().extension) ++moves;
      for (const Stood& then : stood) {
        const double minutes = MinutesBetween(then.at, now.at);
        const double most = kPerDegree * (kApart + 0.1 + kRate * minutes) + kWorthAMove;
        ASSERT_LE(std::abs(now.extension - then.extension), most) << "seed " << seed << ", " << minutes << " min";
      }
      stood.push_back(now);
    }
    // It recovers by itself, and the lens stands where the true temperature wants it.
    const Status end = rig_->GetStatus();
    EXPECT_EQ(end.temperature_fault, "") << seed;
    ASSERT_TRUE(end.temperature) << seed;
    EXPECT_NEAR(end.temperature->value, drawn.true_c(), drawn.fine() ? 0.1 + 1e-9 : 0.5 + 1e-9) << seed;
    const double off = stood.front().extension - kPerDegree * (drawn.true_c() - start_) - Stands();
    EXPECT_LE(std::abs(off), kPerDegree * (drawn.fine() ? 0.3 : 1.1) + kWorthAMove) << seed;
    left_out += end.temperatures_left_out;
  }
  std::printf("%d lenses, %llu readings: %llu left out, %llu moves, none too far\n", count,
              static_cast<unsigned long long>(readings), static_cast<unsigned long long>(left_out),
              static_cast<unsigned long long>(moves));
}

TEST_F(ThermometerRig, WhatTheIssueTells) {
  for (const double gone : {-127.0, 85.0, 0.0, -273.0}) {
    start_ = 20.3;
    ASSERT_NO_FATAL_FAILURE(Begin());
    const double stood = Focus();
    controls_->temperature_c = gone;
    Run(60s);
    EXPECT_EQ(Focus(), stood) << gone;
    EXPECT_NE(rig_->GetStatus().temperature_fault, "") << gone;
    EXPECT_GT(rig_->GetStatus().temperatures_left_out, 50u) << gone;
    controls_->temperature_c = 20.4;
    Run(2s);
    EXPECT_EQ(Focus(), stood) << gone;
    EXPECT_EQ(rig_->GetStatus().temperature_fault, "") << gone;
  }
}

TEST_F(ThermometerRig, ToKnowTheTemperatureForTheFirstTimeIsNoChangeOfIt) {
  start_ = -127.0;
  ASSERT_NO_FATAL_FAILURE(Begin());
  EXPECT_FALSE(rig_->GetStatus().temperature);
  const double stood = Focus();
  controls_->temperature_c = 45.0;
  Run(5s);
  EXPECT_EQ(rig_->GetStatus().temperature, Celsius{45.0});
  EXPECT_EQ(Focus(), stood);
}

// ---- one reading after the other ----------------------------------------------------------------------------------

/// When readings of one number that begin with this are believed: seconds after the first; above 1000: never.
double BelievedAfter(Thermometer& thermometer, double value, double every_s, Instant from) {
  for (double after = 0.0; after < 1000.0; after += every_s) {
    const auto at = from + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(after));
    thermometer.Note(Celsius{value}, at);
    if (thermometer.believed() == Celsius{value}) return after;
  }
  return 1e9;
}

TEST(Thermometers, NumbersOfSensorsThatMeasureNothingAreDoubtedAtFirst) {
  TemperatureConfig config;
  config.range = {Celsius{-55.0}, Celsius{125.0}};
  const Instant start = Instant{} + 1h;
  for (const double doubtful : {85.0, 0.0}) {
    for (const double every_s : {0.1, 0.5, 1.0, 30.0}) {
      Thermometer thermometer(config);
      // At the start for as long as nothing else comes, then for two seconds.
      EXPECT_EQ(BelievedAfter(thermometer, doubtful, every_s, start), 1e9);
      EXPECT_GT(thermometer.left_out(), 0u);
      const Instant later = start + 24h;
      thermometer.Note(Celsius{doubtful + 1.5}, later);
      EXPECT_EQ(thermometer.believed(), Celsius{doubtful + 1.5});
      const double after = BelievedAfter(thermometer, doubtful, every_s, later + 60s);
      EXPECT_GE(after, std::max(2.0, every_s) - 1e-6);
      EXPECT_LE(after, std::max(2.0 + every_s, every_s) + 1e-6);
      Thermometer other(config);
      other.Note(Celsius{doubtful}, start);
      EXPECT_FALSE(other.believed());
      other.Note(Celsius{21.3}, start + 1s);
      EXPECT_EQ(other.believed(), Celsius{21.3});
    }
  }
  for (const double other : {85.1, 84.9375, 0.0625, -0.0625, 1.0, 20.0}) {
    Thermometer thermometer(config);
    EXPECT_EQ(BelievedAfter(thermometer, other, 0.5, start), 0.0) << other;
  }
}

TEST(Thermometers, AFastChangeIsBelievedOnceItCanHaveComeAbout) {
  std::mt19937_64 random(5);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int i = 0; i < testing::ByLevel(200, 1000, 100'000); ++i) {
    TemperatureConfig config;
    config.most_per_minute = uniform(2.0, 50.0);
    Thermometer thermometer(config);
    const double from = uniform(-30.0, 70.0), to = uniform(-30.0, 70.0);
    const Instant start = Instant{} + 1h;
    thermometer.Note(Celsius{from}, start);
    const double every_s = std::exp(uniform(std::log(0.1), std::log(60.0)));
    const double after =
        every_s + BelievedAfter(thermometer, to, every_s,
                                start + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(every_s)));
    const double needs = 60.0 * std::abs(to - from) / config.most_per_minute;
    const double within = 60.0 * 1.0 / config.most_per_minute;
    if (needs < 900.0) {
      EXPECT_GE(after, needs - within - 1e-6) << from << " to " << to;
      EXPECT_LE(after, std::max(needs, 0.0) + every_s + 1e-6) << from << " to " << to;
    }
  }
}

TEST(Thermometers, AThermometerThatFallsSilentHasAFault) {
  Thermometer none(TemperatureConfig{});
  Thermometer thermometer(TemperatureConfig{});
  const Instant start = Instant{} + 1h;
  thermometer.Note(Celsius{20.0}, start);
  for (auto after = 1s; after < 60s; after += 1s) {
    none.Note(std::nullopt, start + after);
    thermometer.Note(std::nullopt, start + after);
    EXPECT_EQ(thermometer.fault().empty(), after < 31s);
  }
  EXPECT_EQ(none.fault(), "");
  EXPECT_EQ(thermometer.believed(), Celsius{20.0});
  thermometer.Note(Celsius{20.1}, start + 61s);
  EXPECT_EQ(thermometer.fault(), "");
  EXPECT_EQ(thermometer.left_out(), 0u);
}

}  // namespace
}  // namespace lensd::rig
