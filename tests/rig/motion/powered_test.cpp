// Motors that count their steps and never lose their power, slow or fast, on a machine that is sometimes busy and over
// a cable that loses some answers: each keeps its place and reaches where it is sent, wherever its count passes zero.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <string>

#include "rig/motion/axis_track.h"
#include "test_level.h"
#include "tests/rig/counting_bench.h"

namespace lensd::rig {
namespace {

class PoweredMotor {
 public:
  explicit PoweredMotor(long seed) {
    std::seed_seq seeds{11L, seed};
    random_.seed(seeds);
    bench_.speed = std::exp(Uniform(std::log(20.0), std::log(20e3)));
    bench_.ramp = Chance(0.3) ? 0.0 : Uniform(0.02, 1.0);
    bench_.refresh = std::chrono::microseconds(Chance(0.5) ? 0 : std::lround(Uniform(1e3, 80e3)));
    station_.kind = {.can_home = Chance(0.5), .speed_known = false};
    if (Chance(0.5)) station_.config.axes[Axis::Focus].speed = bench_.speed * Uniform(0.9, 1.1);
    busy_ = Chance(0.5) ? 0.0 : std::exp(Uniform(std::log(1e-3), std::log(0.3)));
    bench_.zero = station_.kind.can_home || Chance(0.5) ? 0.0 : std::round(Uniform(0.0, kTravel));
    bench_.from = bench_.to = Place();
    loses_ = Chance(0.5) ? 0.0 : std::exp(Uniform(std::log(1e-3), std::log(0.1)));
    bench_.says = Chance(0.5) ? Code::Timeout : Code::Busy;
  }

  std::string Text() const {
    return std::to_string(bench_.speed) + " steps/s, ramp " + std::to_string(bench_.ramp) + " s, zero at " +
           std::to_string(bench_.zero) + ", renewed every " + std::to_string(bench_.refresh.count()) + " ns, busy " +
           std::to_string(busy_) + ", loses answers " + std::to_string(loses_);
  }

  void Move(int times) {
    station_.Open();
    if (bench_.zero != 0.0) {
      ASSERT_TRUE(station_.Say(station_.Shaft()));
    }
    const auto [low, high] = station_.rig->SoftLimits(Axis::Focus);
    for (int i = 0; i < times && !::testing::Test::HasFailure(); ++i) {
      MoveTo(std::clamp(Place(), low.value, high.value));
    }
  }

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  bool Chance(double part) { return Uniform(0.0, 1.0) < part; }
  double Place() {
    const double near = bench_.zero + std::round(Uniform(-30.0, 30.0)), far = std::round(Uniform(0.0, kTravel));
    return std::clamp(Chance(0.3) ? bench_.zero : Chance(0.4) ? near : far, 0.0, kTravel);
  }

  void MoveTo(double target) {
    Answers<MoveOutcome> answers;
    const double stood = station_.Shaft();
    station_.rig->Move(Axis::Focus, At(target), answers.Take());
    const Instant limit = station_.clock.Now() + 200s;
    while (answers.all.empty() && station_.clock.Now() < limit) {
      station_.Run(1ms);
      if (Chance(loses_)) bench_.unanswered = static_cast<int>(Uniform(1.0, 2.9));
      if (!Chance(busy_)) continue;
      station_.clock.AdvanceTo(station_.clock.Now() + std::chrono::microseconds(std::lround(Uniform(0.0, 400e3))));
    }
    const auto moved = answers.only();
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_TRUE(moved->reached) << "from " << stood << " to " << target << ": " << moved->reason;
    EXPECT_TRUE(station_.Focus().homed) << "from " << stood << " to " << target;
  }

  Station station_;
  Bench& bench_ = *station_.bench;
  std::mt19937_64 random_;
  double busy_ = 0.0;   ///< the chance, every millisecond, that the machine does not look for up to 0.4 s
  double loses_ = 0.0;  ///< the chance, every millisecond, that the next one or two answers are lost
};

TEST(Powered, AMotorWithPowerKeepsItsPlace) {
  const long motors = testing::ByLevel(40, 400, 20000);
  for (long i = 0; i < motors && !::testing::Test::HasFailure(); ++i) {
    PoweredMotor motor(i);
    SCOPED_TRACE(::testing::Message() << "motor " << i << ": " << motor.Text());
    motor.Move(4);
  }
}

/// A search sends an axis between two of its positions, be they a thousand or three; it stands at one of them then.
TEST(Powered, WhoStandsWhereItWasSentHasNotLostItsPlace) {
  std::mt19937_64 random(12);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (long i = 0; i < testing::ByLevel(2000, 20000, 1000000) && !::testing::Test::HasFailure(); ++i) {
    const double range = std::round(std::exp(uniform(std::log(2.0), std::log(3000.0))));
    const drivers::AxisCapabilities can{
        .maximum = Native{range}, .feedback = Feedback::Counts, .can_home = i % 2 == 0, .backlash = 0.0};
    const AxisSetup setup = MakeSetup(Axis::Focus, can, {});
    AxisTrack track(setup);
    const Instant start = Instant{} + 1h;
    const double from = std::round(uniform(0.0, range)), target = uniform(0.0, std::min(range, 40.0));
    drivers::AxisState state;
    state.position = Native{from};
    track.Note(state, start, true);
    track.Commanded(AxisTrack::Way::Onward, start);
    const AxisTrack::Heading ours{.target = Native{target}, .live = uniform(0.0, 1.0) < 0.5};
    EXPECT_FALSE(track.FellToZero(Native{std::round(target)}, start + 10ms, ours))
        << "from " << from << " to " << target << " of " << range;
  }
}

}  // namespace
}  // namespace lensd::rig
