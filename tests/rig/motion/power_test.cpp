// Motors that count their steps and lose their power for a moment, at rest and in mid-move, some without one question
// that fails: the count comes back at zero or near it, or, where a question failed, anywhere that the motor cannot have
// reached. Nothing is called reached that is elsewhere, and no other program is blamed.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <string>

#include "test_level.h"
#include "tests/rig/counting_bench.h"

namespace lensd::rig {
namespace {

/// Late: questions are answered after it, and only then the link is found broken.
enum class Noticed { Nothing, LostAnswers, BrokenLink, Gap, Busy, Late };

struct Cut {
  Kind kind;
  bool in_mid_move = false;
  Noticed noticed = Noticed::Nothing;
  double comes_back_at = 0.0;  ///< the count after it
  bool elsewhere = false;      ///< that is to be drawn: nowhere near zero, nor where the motor may be
  int old_readings = 0;        ///< the next so many readings show the count from before
  bool says_moving = false;    ///< for half a second more
  std::string Text() const {
    return std::string(kind.can_home ? "can home" : "has no reference") +
           (kind.speed_known ? "" : ", speed not known") + (in_mid_move ? ", in mid-move" : ", at rest") +
           ", noticed by " + std::to_string(static_cast<int>(noticed)) + ", comes back at " +
           (elsewhere ? "a place elsewhere" : std::to_string(comes_back_at)) + ", " + std::to_string(old_readings) +
           " old readings" + (says_moving ? ", says that it moves" : "");
  }
};

class CutTeller {
 public:
  explicit CutTeller(unsigned seed) : random_(seed) {}
  int Whole(int low, int high) { return std::uniform_int_distribution(low, high)(random_); }
  bool Chance(double part) { return std::uniform_real_distribution(0.0, 1.0)(random_) < part; }
  /// Not where the count would be after a loss of power: nobody could tell that apart, and it would not matter.
  double Place() { return Whole(40, static_cast<int>(kTravel)); }
  Cut Draw() {
    Cut cut;
    cut.kind = {.can_home = Chance(0.6), .speed_known = Chance(0.5)};
    cut.in_mid_move = Chance(0.5);
    cut.noticed = static_cast<Noticed>(Whole(0, 3));
    cut.comes_back_at = Chance(0.4) ? 0.0 : Whole(-3, 3);
    cut.says_moving = cut.in_mid_move && Chance(0.3);
    if (Chance(0.5)) return cut;
    cut.kind.can_home = false;
    cut.elsewhere = true;
    cut.noticed = static_cast<Noticed>(Whole(1, cut.in_mid_move ? 4 : 5));
    cut.old_readings = Chance(0.3) ? Whole(1, 2) : 0;
    return cut;
  }

 private:
  std::mt19937 random_;
};

struct CutTally {
  int cuts = 0, reached = 0, refused = 0, unknown = 0;
};

void CheckTruth(Station& station, const Result<MoveOutcome>& moved, CutTally& tally) {
  EXPECT_FALSE(station.Focus().moved_by_another);
  if (!moved) {
    tally.refused += moved.error().code == Code::NotHomed;
    return;
  }
  EXPECT_NE(moved->cause, MoveCause::External) << moved->reason;
  if (moved->cause == MoveCause::PositionUnknown) {
    ++tally.unknown;
    EXPECT_FALSE(station.Focus().homed);
    return;
  }
  if (!moved->reached) return;
  ++tally.reached;
  EXPECT_NEAR(station.Shaft(), moved->position.value, moved->bound.value + 1e-6) << "falsely reached";
}

/// `stood` and `target`: of the motion that it cuts.
double CountAfter(const Cut& cut, CutTeller& draw, double stood, double target) {
  if (!cut.elsewhere) return cut.comes_back_at;
  const double low = std::min(stood, target) - 40.0, high = std::max(stood, target) + 40.0;
  for (;;) {
    const double place = draw.Whole(-static_cast<int>(kTravel), 2 * static_cast<int>(kTravel));
    if (std::abs(place) > 40.0 && (place < low || place > high)) return place;
  }
}

void LosePower(Station& station, const Cut& cut, CutTeller& draw, double count) {
  Bench& bench = *station.bench;
  const Instant now = station.clock.Now();
  bench.old_count = std::round(bench.ShaftAt(now) - bench.zero);
  bench.old_moving = cut.in_mid_move;
  bench.LosePower(now, count);
  bench.old_readings = cut.old_readings;
  if (cut.noticed == Noticed::Late) station.Run(std::chrono::milliseconds(draw.Whole(1, 1000)));
  bench.unanswered = cut.noticed == Noticed::LostAnswers                                  ? draw.Whole(1, 2)
                     : cut.noticed == Noticed::BrokenLink || cut.noticed == Noticed::Late ? 1
                                                                                          : 0;
  bench.says = cut.noticed == Noticed::LostAnswers ? Code::Timeout
               : cut.noticed == Noticed::Busy      ? Code::Busy
                                                   : Code::Disconnected;
  if (cut.says_moving) bench.says_moving_until = now + 500ms;
  if (cut.noticed != Noticed::Gap && cut.noticed != Noticed::Busy) return;
  bench.answers = false;
  // A lens at rest is asked twice a second: of a count elsewhere nobody knows why, unless one of these questions
  // failed.
  const int unasked = cut.elsewhere && !cut.in_mid_move ? 600 : 0;
  station.Run(
      std::chrono::milliseconds(unasked + (cut.noticed == Noticed::Gap ? draw.Whole(50, 300) : draw.Whole(20, 8000))));
  bench.answers = true;
}

void Play(const Cut& cut, CutTeller& draw, CutTally& tally) {
  ++tally.cuts;
  Station station;
  station.kind = cut.kind;
  station.bench->from = station.bench->to = draw.Place();
  station.Open();
  if (cut.kind.can_home) {
    ASSERT_TRUE(station.Home()->reached);
  }
  const double stood = cut.in_mid_move && draw.Chance(0.3) ? draw.Whole(900, static_cast<int>(kTravel)) : draw.Place();
  ASSERT_TRUE(station.Move(At(stood))->reached);
  station.Run(std::chrono::milliseconds(draw.Chance(0.3) ? 0 : draw.Whole(1, 1500)));
  Answers<MoveOutcome> midway;
  // A motor that is sent to zero and says zero is there for all that anybody can see, unless it is known to be slower.
  const bool far = stood > 900.0 && cut.kind.speed_known;
  double target = (far || !cut.in_mid_move) && draw.Chance(0.5) ? 0.0 : draw.Place();
  while (std::abs(target - stood) < 20.0) target = draw.Place();
  if (cut.in_mid_move) {
    station.rig->Move(Axis::Focus, At(target), midway.Take());
    // It is not cut where it counts almost nothing; on its way to zero not before anybody can have seen it on its way,
    // nor where 0.4 s at twice its speed, in which a register may not be renewed, lead there.
    const double way = std::min(std::abs(target - stood), std::max(20.0, stood - 40.0));
    station.Run(std::chrono::microseconds(
        std::lround(1e6 * way / kSpeed * (target == 0.0 ? draw.Whole(20, 40) : draw.Whole(5, 90)) / 100.0)));
    ASSERT_TRUE(midway.all.empty());
  }
  LosePower(station, cut, draw, CountAfter(cut, draw, stood, cut.in_mid_move ? target : stood));
  if (cut.in_mid_move) CheckTruth(station, station.Await(midway), tally);
  // A motion that begins before the new count was read may lead there.
  if (cut.elsewhere && cut.old_readings > 0) station.Run(1600ms);
  if (draw.Chance(0.5)) station.Run(std::chrono::milliseconds(draw.Whole(1, 2000)));
  for (int i = 0; i < 3; ++i) {
    const auto moved = station.Move(At(draw.Chance(0.3) ? target : draw.Place()));
    CheckTruth(station, moved, tally);
  }
  station.Run(2s);
  EXPECT_FALSE(station.Focus().homed);
  EXPECT_EQ(station.Focus().lost, !cut.kind.can_home);
  if (!cut.kind.can_home) return;
  const auto refused = station.Move(At(500));
  ASSERT_FALSE(refused) << refused->reason;
  EXPECT_EQ(refused.error().code, Code::NotHomed);
  ASSERT_TRUE(station.Home()->reached);
  for (const double place : {draw.Place(), 0.0}) {
    const auto moved = station.Move(At(place));
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_TRUE(moved->reached) << moved->reason;
    EXPECT_EQ(station.Shaft(), place);
  }
}

TEST(Power, AMomentWithoutItIsNeitherAMoveNorAnotherProgram) {
  const long cuts = testing::ByLevel(40, 400, 40000);
  CutTally tally;
  for (long i = 0; i < cuts && !::testing::Test::HasFailure(); ++i) {
    CutTeller draw(static_cast<unsigned>(i + 1));
    const Cut cut = draw.Draw();
    SCOPED_TRACE(::testing::Message() << "seed " << i + 1 << ": " << cut.Text());
    Play(cut, draw, tally);
  }
  std::printf("%d cuts: %d moves reached, %d refused, %d with the place unknown\n", tally.cuts, tally.reached,
              tally.refused, tally.unknown);
}

/// On a machine with no time for it: nothing is read between the start of a move from zero and some time after its
/// stop.
TEST(Power, AStopNearZeroThatIsReadLateIsNoLossOfIt) {
  const long stops = testing::ByLevel(40, 400, 40000);
  for (long i = 0; i < stops && !::testing::Test::HasFailure(); ++i) {
    CutTeller draw(static_cast<unsigned>(i + 1));
    Station station;
    station.kind = {.can_home = draw.Chance(0.5), .speed_known = draw.Chance(0.5)};
    station.Open();
    if (station.kind.can_home) {
      ASSERT_TRUE(station.Home()->reached);
    }
    station.Run(std::chrono::milliseconds(draw.Whole(1, 1500)));
    const int way = draw.Whole(1, 30), unread_ms = draw.Whole(0, 3000), waited_ms = draw.Whole(1, 1500);
    SCOPED_TRACE(::testing::Message() << "seed " << i + 1 << ": stopped after " << way << " steps, nothing read for "
                                      << unread_ms << " ms, the next move after " << waited_ms << " ms");
    Answers<MoveOutcome> midway;
    station.rig->Move(Axis::Focus, At(draw.Place()), midway.Take());
    station.rig->Step(station.clock.Now());
    station.clock.AdvanceTo(station.clock.Now() + std::chrono::microseconds(std::lround(1e6 * way / kSpeed)));
    station.rig->Stop({Axis::Focus}, [](const Result<void>& stopped) { EXPECT_TRUE(stopped); });
    station.clock.AdvanceTo(station.clock.Now() + std::chrono::milliseconds(unread_ms));
    station.Run(std::chrono::milliseconds(waited_ms));
    EXPECT_EQ(midway.only().error().code, Code::Cancelled);
    const auto moved = station.Move(At(draw.Chance(0.5) ? 0.0 : draw.Place()));
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_TRUE(moved->reached) << moved->reason;
    EXPECT_EQ(station.Shaft(), moved->position.value);
    EXPECT_TRUE(station.Focus().homed);
  }
}

}  // namespace
}  // namespace lensd::rig
