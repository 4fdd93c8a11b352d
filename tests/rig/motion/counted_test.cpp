// Axes that count their steps, and what lensd says of them after a loss of power, against the truth of a shaft: nothing
// is called reached that is elsewhere, and nothing that stands where it stood is refused.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "test_level.h"
#include "tests/rig/counting_bench.h"

namespace lensd::rig {
namespace {

/// What a controller says that has had no power, or no cable.
enum class Back { Same, Zero, Saved, Elsewhere };
/// How lensd sees it: as a lens that does not answer for a while, not at all, or it does not run then.
enum class Seen { Gap, Nothing, Killed };

struct Story {
  Kind kind;
  Restore restore = Restore::Never;
  bool power_fails = true;  ///< else the cable alone
  bool in_mid_move = false;
  Back back = Back::Zero;
  Seen seen = Seen::Gap;
  std::string Text() const {
    return std::string(drivers::FeedbackName(kind.feedback)) + (kind.can_home ? ", can home" : "") +
           (kind.speed_known ? "" : ", speed not known") + (kind.counts_below_zero ? "" : ", counts from 0") +
           ", restore " + std::to_string(static_cast<int>(restore)) + (power_fails ? ", power fails" : ", cable") +
           (in_mid_move ? " in mid-move" : " at rest") + ", back as " + std::to_string(static_cast<int>(back)) +
           ", seen as " + std::to_string(static_cast<int>(seen));
  }
};

struct Tally {
  int stories = 0, reached = 0, unknown = 0, restored = 0, said = 0;
};

class Teller {
 public:
  explicit Teller(unsigned seed) : random_(seed) {}
  int Whole(int low, int high) { return std::uniform_int_distribution(low, high)(random_); }
  bool Chance(double part) { return std::uniform_real_distribution(0.0, 1.0)(random_) < part; }
  double Place() { return Whole(0, static_cast<int>(kTravel)); }

  Story Draw() {
    constexpr Feedback kFeedbacks[] = {Feedback::Counts, Feedback::Counts, Feedback::Counts, Feedback::Encoder};
    Story story;
    story.kind.feedback = kFeedbacks[Whole(0, 3)];
    story.kind.can_home = story.kind.feedback == Feedback::Counts ? Chance(0.2) : Chance(0.5);
    story.kind.speed_known = Chance(0.7);
    story.kind.counts_below_zero = Chance(0.7);
    story.restore = static_cast<Restore>(Whole(0, 3));
    story.power_fails = Chance(0.8);
    story.in_mid_move = Chance(0.4);
    story.back = static_cast<Back>(Whole(0, 3));
    story.seen = static_cast<Seen>(Whole(0, 2));
    // Nothing but zero is to be told from a motion where no outage is seen, and that by the axis' speed.
    if (story.seen == Seen::Nothing && story.back != Back::Same) story.back = Back::Zero;
    if (story.seen == Seen::Nothing && story.in_mid_move) story.kind.speed_known = true;
    // What a device says that can home is the device's to know.
    if (story.kind.feedback == Feedback::Counts && story.kind.can_home) {
      story.restore = Restore::Never;
      if (story.back != Back::Same) story.back = Back::Zero;
      if (story.seen != Seen::Gap) story.seen = Seen::Gap;
    }
    return story;
  }

 private:
  std::mt19937 random_;
};

/// The shaft is where the move says that it is.
void CheckReached(Station& station, const Result<MoveOutcome>& moved, double target, Tally& tally) {
  if (!moved || !moved->reached || moved->cause == MoveCause::PositionUnknown) return;
  ++tally.reached;
  EXPECT_NEAR(station.Shaft(), target, moved->bound.value + 1e-6) << moved->reason;
  EXPECT_NEAR(station.Shaft(), moved->position.value, moved->bound.value + 1e-6);
  EXPECT_TRUE(moved->extension);
}

void Outage(Station& station, const Story& story, Teller& draw, double target) {
  const Instant now = station.clock.Now();
  Bench& bench = *station.bench;
  if (story.power_fails) {
    const double count = std::round(bench.ShaftAt(now) - bench.zero);
    double elsewhere = draw.Place();
    while (std::abs(elsewhere + bench.zero - target) < 3.0) elsewhere = draw.Place();
    bench.LosePower(now, story.back == Back::Same    ? count
                         : story.back == Back::Zero  ? 0.0
                         : story.back == Back::Saved ? bench.saved
                                                     : elsewhere);
  }
  if (story.seen == Seen::Killed) {
    station.Kill();
    station.clock.AdvanceTo(station.clock.Now() + std::chrono::milliseconds(draw.Whole(1, 3000)));
    station.Open();
  } else if (story.seen == Seen::Gap) {
    bench.answers = false;
    station.Run(std::chrono::milliseconds(draw.Whole(1000, 3000)));
    bench.answers = true;
  }
  station.Run(2s);
}

void CheckUnknown(Station& station, Teller& draw, Tally& tally) {
  ++tally.unknown;
  EXPECT_FALSE(station.Focus().homed);
  EXPECT_FALSE(station.rig->GetStatus().vergence);
  EXPECT_FALSE(station.rig->GetStatus().extension);
  const auto refused = station.Move(ToExtension(500));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Code::NotHomed);
  // Steps are steps wherever they are made.
  const double shaft = station.Shaft(), here = station.Focus().position.value;
  const double by = here > 500 ? -draw.Whole(1, 100) : draw.Whole(1, 100);
  const auto stepped = station.Move(By(by));
  ASSERT_TRUE(stepped) << stepped.error().message;
  EXPECT_EQ(stepped->cause, MoveCause::PositionUnknown) << stepped->reason;
  EXPECT_FALSE(stepped->extension);
  EXPECT_NEAR(station.Shaft(), shaft + by, 1e-6);
  const auto there = station.Move(At(draw.Whole(0, 1000)));
  ASSERT_TRUE(there) << there.error().message;
  EXPECT_EQ(there->cause, MoveCause::PositionUnknown) << there->reason;
}

/// Somebody looks, and says it.
void SayWhereItStands(Station& station, Teller& draw, Tally& tally) {
  ++tally.said;
  // By its count it may have been sent beyond its travel, where a real one would have run against its end.
  Bench& bench = *station.bench;
  if (bench.to < 0.0 || bench.to > kTravel) {
    const double inside = draw.Place();
    bench.zero += inside - bench.to;
    bench.from = bench.to = inside;
  }
  const double shaft = station.Shaft();
  const auto said = station.Say(shaft);
  ASSERT_TRUE(said) << said.error().message;
  EXPECT_EQ(station.Shaft(), shaft);
  EXPECT_TRUE(station.Focus().homed);
  EXPECT_EQ(station.Focus().referenced, true);
  EXPECT_EQ(station.Focus().position.value, shaft);
}

void CheckMoves(Station& station, Teller& draw, Tally& tally) {
  const auto [low, high] = station.rig->SoftLimits(Axis::Focus);
  ASSERT_GE(low.value, 0.0);
  ASSERT_LE(high.value, kTravel);
  for (int i = 0; i < 2; ++i) {
    const double target = draw.Whole(static_cast<int>(low.value), static_cast<int>(high.value));
    const auto moved = station.Move(draw.Chance(0.5) ? At(target) : ToExtension(target));
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_TRUE(moved->reached) << moved->reason;
    CheckReached(station, moved, target, tally);
  }
}

void Tell(const Story& story, Teller& draw, Tally& tally) {
  ++tally.stories;
  Station station;
  station.kind = story.kind;
  station.config.axes[Axis::Focus].restore = story.restore;
  station.bench->from = station.bench->to = draw.Place();
  station.Open();
  // A first start: believed as it reports.
  ASSERT_TRUE(station.Focus().homed);
  EXPECT_EQ(station.Focus().referenced, story.kind.OnlyCounts() ? std::optional(false) : std::nullopt);
  const double stood = draw.Whole(50, 950);
  ASSERT_TRUE(station.Move(At(stood))->reached);
  station.Run(1s);
  // A motor that is sent to zero and says zero is there for all that anybody can see (power_test.cpp has what can be
  // seen).
  const int least = story.seen == Seen::Nothing && story.in_mid_move ? 20 : 0;
  const double target =
      stood > 500 ? draw.Whole(least, static_cast<int>(stood) - 300) : draw.Whole(static_cast<int>(stood) + 300, 1000);
  Answers<MoveOutcome> answers;
  if (story.in_mid_move) {
    station.rig->Move(Axis::Focus, At(target), answers.Take());
    station.Run(std::chrono::milliseconds(draw.Whole(100, 400)));
  }
  const double raw = station.bench->to - station.bench->zero;
  Outage(station, story, draw, story.in_mid_move ? target : stood);
  if (!answers.all.empty() && answers.all[0]) CheckReached(station, answers.all[0], target, tally);
  const double raw_now = station.bench->to - station.bench->zero;
  const bool stands_where_it_stood = !story.in_mid_move && raw == raw_now;
  const bool at_zero = story.power_fails && story.back == Back::Zero;
  const bool restores = story.kind.OnlyCounts() && !story.in_mid_move && at_zero && story.seen != Seen::Nothing &&
                        story.restore != Restore::Never;
  if (stands_where_it_stood || restores || story.kind.feedback == Feedback::Encoder) {
    const bool unknown = story.kind.feedback == Feedback::Encoder && !station.Focus().homed;  // killed in mid-move
    tally.restored += restores;
    if (!unknown) {
      EXPECT_TRUE(station.Focus().homed);
      EXPECT_EQ(station.Focus().position.value, station.Shaft());
      CheckMoves(station, draw, tally);
    }
  } else if (!station.Focus().homed && story.kind.OnlyCounts()) {
    CheckUnknown(station, draw, tally);
    if (!::testing::Test::HasFatalFailure()) SayWhereItStands(station, draw, tally);
    if (!::testing::Test::HasFatalFailure()) CheckMoves(station, draw, tally);
  } else if (!station.Focus().homed) {
    EXPECT_EQ(station.Move(At(500)).error().code, Code::NotHomed);
  } else {
    CheckMoves(station, draw, tally);  // it is known, so it had better be true
  }
  if (::testing::Test::HasFatalFailure() || !story.kind.OnlyCounts()) return;
  // What was said or restored outlives lensd.
  station.Run(1s);
  const double shaft = station.Shaft();
  station.Kill();
  station.Open();
  EXPECT_TRUE(station.Focus().homed);
  EXPECT_EQ(station.Focus().position.value, shaft);
  CheckMoves(station, draw, tally);
}

TEST(Counted, NothingIsReachedElsewhereAndNothingRefusedThatStandsWhereItStood) {
  const long stories = testing::ByLevel(80, 600, 100000);
  Tally tally;
  for (long i = 0; i < stories && !::testing::Test::HasFailure(); ++i) {
    Teller draw(static_cast<unsigned>(i + 1));
    const Story story = draw.Draw();
    SCOPED_TRACE(::testing::Message() << "seed " << i + 1 << ": " << story.Text());
    Tell(story, draw, tally);
  }
  std::printf("%d stories: %d moves reached, the place unknown in %d, restored in %d, said in %d\n", tally.stories,
              tally.reached, tally.unknown, tally.restored, tally.said);
  EXPECT_GT(tally.unknown, stories / 10);
  EXPECT_GT(tally.restored, stories / 100);
}

class CountedTest : public ::testing::Test {
 protected:
  void Open(double shaft, const Kind& kind = {}) {
    station_.kind = kind;
    station_.bench->from = station_.bench->to = shaft;
    station_.Open();
  }
  Station station_;
};

TEST_F(CountedTest, OneFalseReadingOfZeroLosesNothing) {
  Open(700);
  station_.Run(1s);
  station_.bench->false_zeros = 1;
  station_.Run(2s);
  EXPECT_TRUE(station_.Focus().homed);
  EXPECT_EQ(station_.Focus().position.value, 700.0);
  Answers<MoveOutcome> answers;
  station_.rig->Move(Axis::Focus, At(300), answers.Take());
  station_.Run(200ms);
  station_.bench->false_zeros = 2;
  const auto moved = station_.Await(answers);
  ASSERT_TRUE(moved);
  EXPECT_TRUE(moved->reached) << moved->reason;
  EXPECT_EQ(station_.Shaft(), 300.0);
}

TEST_F(CountedTest, AnInterruptedLinkLosesNoPlaceThatTheMotorGoesOnTo) {
  Open(100);
  for (const Duration gap : {300ms, 5000ms}) {  // on its way, and there
    const double target = station_.Shaft() > 500 ? 50 : 950;
    Answers<MoveOutcome> answers;
    station_.rig->Move(Axis::Focus, At(target), answers.Take());
    station_.Run(200ms);
    station_.bench->answers = false;
    station_.Run(gap);
    station_.bench->answers = true;
    station_.Run(5s);
    EXPECT_TRUE(station_.Focus().homed);
    EXPECT_EQ(station_.Focus().position.value, station_.Shaft());
  }
}

TEST_F(CountedTest, ItIsNotSaidWhileItMovesNorBeyondItsTravelNorWhereSomethingTellsBetter) {
  Open(100);
  EXPECT_EQ(station_.Say(1001).error().code, Code::OutOfRange);
  EXPECT_EQ(station_.Say(-1).error().code, Code::OutOfRange);
  EXPECT_EQ(station_.Say(std::nan("")).error().code, Code::OutOfRange);
  Answers<MoveOutcome> answers;
  station_.rig->Move(Axis::Focus, At(900), answers.Take());
  station_.Run(100ms);
  EXPECT_EQ(station_.Say(500).error().code, Code::Busy);
  EXPECT_TRUE(station_.Await(answers)->reached);
  station_.bench->answers = false;
  EXPECT_EQ(station_.Say(500).error().code, Code::Disconnected);
  station_.bench->answers = true;
  for (const Kind& kind : {Kind{.feedback = Feedback::Encoder}, Kind{.can_home = true},
                           Kind{.feedback = Feedback::Echo}, Kind{.feedback = Feedback::None}}) {
    Station other;
    other.kind = kind;
    other.Open();
    EXPECT_EQ(other.Say(500).error().code, Code::Unsupported);
    EXPECT_FALSE(other.Focus().referenced);
  }
}

TEST_F(CountedTest, TheWholeTravelIsInReachWhereTheCountGoesBelowZero) {
  Open(700);
  station_.bench->LosePower(station_.clock.Now(), 0.0);
  EXPECT_EQ(station_.Say(700).error().code, Code::Timeout);  // the first reading of 0 may be a false one
  station_.Run(1s);
  ASSERT_TRUE(station_.Say(700));
  EXPECT_EQ(station_.rig->SoftLimits(Axis::Focus), std::pair(Native{0}, Native{1000}));
  EXPECT_TRUE(station_.Move(At(0))->reached);
  EXPECT_EQ(station_.Shaft(), 0.0);
  EXPECT_TRUE(station_.Move(At(1000))->reached);
  EXPECT_EQ(station_.Shaft(), 1000.0);
}

TEST_F(CountedTest, ACountFromZeroLeavesWhatIsAbove) {
  Open(700, {.counts_below_zero = false});
  station_.bench->LosePower(station_.clock.Now(), 0.0);
  EXPECT_EQ(station_.Say(700).error().code, Code::Timeout);  // the first reading of 0 may be a false one
  station_.Run(1s);
  ASSERT_TRUE(station_.Say(700));
  EXPECT_EQ(station_.rig->SoftLimits(Axis::Focus), std::pair(Native{700}, Native{1000}));
}

}  // namespace
}  // namespace lensd::rig
