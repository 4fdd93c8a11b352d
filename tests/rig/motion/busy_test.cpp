// A lens that says that it is busy is asked again; where a move is given up, its motor is told to stop as soon as it
// listens.
#include <chrono>
#include <cmath>
#include <random>
#include <string>

#include "test_level.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

/// The fake lens, busy in a span of time.
class BusyLens final : public drivers::Lens {
 public:
  BusyLens(std::unique_ptr<drivers::Lens> inner, const Clock& clock)
      : Lens(inner->capabilities()), inner_(std::move(inner)), clock_(clock) {}

  Instant from{}, to{};
  Code says = Code::Busy;
  bool reads = true, commands = true;
  bool obeys = false;  ///< a command that it refuses
  double loses = 0.0;  ///< of all answers
  std::mt19937_64 random{3};
  int stops = 0;
  double Position() const { return static_cast<const testing::FakeLens&>(*inner_).PositionNow(Axis::Focus); }

 private:
  bool Now(bool kind) const { return kind && clock_.Now() >= from && clock_.Now() < to; }
  Error Why() const { return {says, "the drive says that it is busy"}; }
  bool Loses() { return std::uniform_real_distribution(0.0, 1.0)(random) < loses; }
  /// The answer to a command may be lost after it was obeyed.
  Result<void> Arrives(Result<void> answer) {
    if (Loses()) return Fail(Code::Timeout, "the drive did not answer in time");
    return answer;
  }
  Result<void> DoStartHome(Axis axis) override {
    if (Now(commands)) return PassOn(Why());
    return Arrives(inner_->StartHome(axis));
  }
  Result<void> DoStartMove(Axis axis, Native target) override {
    if (Now(commands) && obeys) (void)inner_->StartMove(axis, target);
    if (Now(commands)) return PassOn(Why());
    return Arrives(inner_->StartMove(axis, target));
  }
  Result<drivers::LensState> DoRead() override {
    if (Loses()) return Fail(random() % 3 == 0 ? Code::Protocol : Code::Timeout, "the drive did not answer in time");
    if (Now(reads)) return PassOn(Why());
    return inner_->Read();
  }
  Result<void> DoStop(Axis axis) override {
    if (Now(commands)) return PassOn(Why());
    ++stops;
    return inner_->Stop(axis);
  }

  const std::unique_ptr<drivers::Lens> inner_;
  const Clock& clock_;
};

class BusyTest : public RigTest {
 protected:
  /// A lens that truly makes `speed` steps a second, and is taken to make 1000.
  void OpenBusy(double speed) {
    controls_->speed = speed;
    controls_->focus =
        drivers::AxisCapabilities{.maximum = Native{1000.0}, .feedback = drivers::Feedback::Encoder, .backlash = 0.0};
    RigConfig config;
    config.axes[Axis::Focus].speed = 1000.0;
    drivers::Device device = testing::MakeFakeDevice(clock_, controls_);
    auto busy = std::make_unique<BusyLens>(std::move(device.lens), clock_);
    lens_ = busy.get();
    device.lens = std::move(busy);
    device.camera.reset();
    rig_ = Rig::Create(config, std::move(device), clock_).value();
    Run(10ms);
  }
  bool Turns() {
    const double before = lens_->Position();
    Run(100ms);
    return lens_->Position() != before;
  }
  BusyLens* lens_ = nullptr;
};

TEST_F(BusyTest, AMoveEndsAsItShouldHoweverLongItIsAskedAgain) {
  std::mt19937_64 random(1);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (long i = 0; i < testing::ByLevel(30, 150, 3000); ++i) {
    OpenBusy(1000.0);
    const auto lasts = std::chrono::microseconds(std::lround(1e3 * std::exp(draw(0.0, std::log(4500.0)))));
    lens_->from = clock_.Now() + std::chrono::milliseconds(std::lround(draw(-5.0, 400.0)));
    lens_->to = lens_->from + lasts;
    lens_->reads = random() % 4 != 0;
    lens_->commands = random() % 2 != 0;
    const double target = std::round(draw(0.0, 1000.0));
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, At(target), moved.Take());
    const Instant began = clock_.Now();
    while (moved.all.empty() && clock_.Now() < began + 30s) {
      Run(1ms);
      ASSERT_TRUE(rig_->GetStatus().connected) << rig_->GetStatus().problem;
    }
    ASSERT_EQ(moved.all.size(), 1u);
    ASSERT_TRUE(moved.all[0]) << moved.all[0].error().message;
    EXPECT_TRUE(moved.all[0]->reached) << moved.all[0]->reason;
    EXPECT_EQ(lens_->Position(), target);
  }
}

TEST_F(BusyTest, AnswersThatAreLostCostTimeAndNotTheMove) {
  std::mt19937_64 random(3);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (long i = 0; i < testing::ByLevel(30, 150, 3000); ++i) {
    OpenBusy(1000.0);
    lens_->random.seed(random());
    // Some of them among answers that it is busy.
    lens_->from = clock_.Now() + std::chrono::milliseconds(std::lround(draw(-5.0, 400.0)));
    lens_->to = lens_->from + std::chrono::milliseconds(std::lround(random() % 2 == 0 ? 0.0 : draw(1.0, 3000.0)));
    lens_->commands = random() % 2 == 0;
    const double target = std::round(draw(0.0, 1000.0));
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, At(target), moved.Take());
    Run(2ms);
    lens_->loses = draw(0.0, 0.7);
    RunUntil(moved, 60s);
    ASSERT_EQ(moved.all.size(), 1u);
    ASSERT_TRUE(moved.all[0]) << moved.all[0].error().message << ", " << lens_->loses << " of the answers lost";
    EXPECT_TRUE(moved.all[0]->reached) << moved.all[0]->reason;
    EXPECT_EQ(lens_->Position(), target);
    rig_.reset();
  }
}

TEST_F(BusyTest, ACommandThatIsObeyedAndAnsweredWithErrorsForAMomentIsFollowed) {
  std::mt19937_64 random(5);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (long i = 0; i < testing::ByLevel(30, 150, 3000); ++i) {
    OpenBusy(1000.0);
    const Code codes[] = {Code::Protocol, Code::Timeout, Code::Busy};
    lens_->says = codes[random() % 3];
    lens_->obeys = random() % 2 == 0;
    lens_->reads = random() % 4 != 0;
    lens_->from = clock_.Now();
    lens_->to = lens_->from + std::chrono::microseconds(std::lround(1e3 * std::exp(draw(0.0, std::log(950.0)))));
    const double target = std::round(draw(0.0, 1000.0));
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, At(target), moved.Take());
    RunUntil(moved, 30s);
    ASSERT_EQ(moved.all.size(), 1u);
    ASSERT_TRUE(moved.all[0]) << moved.all[0].error().message;
    EXPECT_TRUE(moved.all[0]->reached) << moved.all[0]->reason;
    EXPECT_EQ(lens_->Position(), target);
    EXPECT_EQ(lens_->stops, 0);
  }
}

TEST_F(BusyTest, ALensThatCeasesToAnswerInMidMoveIsAnErrorInSeconds) {
  for (const Code code : {Code::Timeout, Code::Protocol, Code::Disconnected}) {
    OpenBusy(10.0);
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, At(900), moved.Take());
    Run(500ms);
    lens_->says = code;
    lens_->from = clock_.Now();
    lens_->to = lens_->from + 1h;
    RunUntil(moved, 6s);
    ASSERT_EQ(moved.all.size(), 1u);
    EXPECT_FALSE(moved.all[0] && moved.all[0]->reached);
    rig_.reset();
  }
}

TEST_F(BusyTest, AMotorWhoseMoveIsGivenUpIsToldToStopAsSoonAsAnybodyListens) {
  std::mt19937_64 random(2);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  long stopped = 0, not_yet = 0;
  for (long i = 0; i < testing::ByLevel(20, 80, 2000); ++i) {
    OpenBusy(20.0);
    Answers<MoveOutcome> moved;
    rig_->Move(Axis::Focus, At(900), moved.Take());
    Run(std::chrono::milliseconds(std::lround(draw(5.0, 1000.0))));
    lens_->says = random() % 3 == 0 ? Code::Timeout : random() % 2 == 0 ? Code::Protocol : Code::Busy;
    lens_->from = clock_.Now();
    lens_->to = clock_.Now() + std::chrono::milliseconds(std::lround(draw(12e3, 25e3)));
    lens_->commands = random() % 2 == 0;
    RunUntil(moved, 30s);
    ASSERT_EQ(moved.all.size(), 1u);
    const std::string said = moved.all[0] ? moved.all[0]->reason : moved.all[0].error().message;
    EXPECT_FALSE(moved.all[0] && moved.all[0]->reached);
    if (clock_.Now() >= lens_->to) continue;
    const bool says_stopped = said.find("the motor was commanded to stop") != std::string::npos;
    EXPECT_EQ(says_stopped, !lens_->commands) << said;
    EXPECT_EQ(said.find("the motor is not stopped yet") != std::string::npos, lens_->commands) << said;
    (says_stopped ? stopped : not_yet) += 1;
    EXPECT_EQ(lens_->stops, says_stopped ? 1 : 0);
    EXPECT_EQ(Turns(), !says_stopped);
    Run(lens_->to - clock_.Now() + 100ms);
    EXPECT_FALSE(Turns()) << said;
    EXPECT_LT(lens_->Position(), 890.0);
    Answers<MoveOutcome> again;
    rig_->Move(Axis::Focus, At(lens_->Position() > 400.0 ? 200.0 : 600.0), again.Take());
    Run(200ms);
    EXPECT_TRUE(Turns()) << "it is told to stop once only";
    rig_.reset();  // answers `again` while it is there
  }
  EXPECT_GT(stopped, 0);
  EXPECT_GT(not_yet, 0);
}

TEST_F(BusyTest, ALensThatIsBusyForAMomentIsNotAbsent) {
  OpenBusy(1000.0);
  for (const auto lasts : {10ms, 100ms, 1000ms, 4000ms}) {
    lens_->from = clock_.Now();
    lens_->to = clock_.Now() + lasts;
    for (const Instant end = lens_->to + 1s; clock_.Now() < end; Run(1ms)) {
      ASSERT_TRUE(rig_->GetStatus().connected) << rig_->GetStatus().problem;
    }
  }
  lens_->from = clock_.Now();
  lens_->to = clock_.Now() + 10s;
  Run(8s);
  EXPECT_FALSE(rig_->GetStatus().connected);
  Run(4s);
  EXPECT_TRUE(rig_->GetStatus().connected);
}

}  // namespace
}  // namespace lensd::rig
