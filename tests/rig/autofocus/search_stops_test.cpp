// Stops and newer commands in the midst of a search under conditions: what ends it, what goes back, and what is said to
// stay.
#include <string>
#include <vector>

#include "tests/rig/search_conditions_bench.h"

namespace lensd::rig {
namespace {

TEST(SearchConditions, AStopMovesNothingAndItsAnswerSaysWhatStays) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  const double iris = bench.Now().iris;
  bench.rig->Stop({}, [](const Result<void>&) {});
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Code::Cancelled);
  EXPECT_NE(answer.error().message.find("the iris is left where it is"), std::string::npos) << answer.error().message;
  EXPECT_NE(answer.error().message.find("was at f/8"), std::string::npos) << answer.error().message;
  bench.Run(2s);
  EXPECT_EQ(bench.Now().iris, iris);
  EXPECT_EQ(bench.Now().exposure, before.exposure);  // nothing moves for that
}

TEST(SearchConditions, AStopOfTheFocusAloneBringsTheIrisBack) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  bench.rig->Stop({Axis::Focus}, [](const Result<void>&) {});
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Code::Cancelled);
  EXPECT_EQ(answer.error().message, "stopped");
  EXPECT_EQ(bench.Now(), before);
}

TEST(SearchConditions, AStopOfTheFilterEndsASearchWithoutOne) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  bench.rig->Stop({Axis::Filter}, [](const Result<void>&) {});
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Code::Cancelled);
  EXPECT_EQ(answer.error().message, "stopped");
  EXPECT_EQ(bench.Now(), before);
}

TEST(SearchConditions, AStopOfTheFilterEndsAnAutofocusWithoutConditionsAndTheFocusRests) {
  Bench bench(SceneOf(kWall));
  bench.Begin(AutofocusRequest{});
  bench.RunUntil([&] { return bench.rig->GetStatus().axes[Axis::Focus]->moving; }, 10s);
  ASSERT_TRUE(bench.rig->GetStatus().axes[Axis::Focus]->moving);
  bench.rig->Stop({Axis::Filter}, [](const Result<void>&) {});
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Code::Cancelled);
  bench.Run(500ms);
  const Native there = bench.rig->GetStatus().axes[Axis::Focus]->position;
  bench.Run(500ms);
  EXPECT_EQ(bench.rig->GetStatus().axes[Axis::Focus]->position.value, there.value);
}

TEST(SearchConditions, AStopWhileTheConditionsAreBeingSetIsCancelled) {
  for (const std::vector<Axis>& named : {std::vector<Axis>{}, {Axis::Focus}, {Axis::Iris}, {Axis::Filter}}) {
    Bench bench(SceneOf(kWall));
    bench.Begin(WideOpen());
    bench.Run(5ms);
    ASSERT_EQ(bench.rig->GetStatus().activity.step, 0);
    bench.rig->Stop(named, [](const Result<void>&) {});
    const auto& answer = bench.End();
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().code, Code::Cancelled) << answer.error().message;
  }
}

TEST(SearchConditions, AnAxisThatRestsWhereItWasIsNotToldAsLeft) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  SearchConditions conditions = WideOpen();
  conditions.filter = Native{before.filter};
  bench.Begin(conditions);
  bench.RunIntoTheSearch();
  bench.rig->Stop({Axis::Filter}, [](const Result<void>&) {});
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().message, "stopped");
  EXPECT_EQ(bench.Now(), before);
}

TEST(SearchConditions, ANewerCommandForTheFocusBringsTheIrisBackAndIsCarriedOut) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  std::optional<Result<MoveOutcome>> moved;
  bench.rig->Move(Axis::Focus, {.kind = Target::Kind::Native, .value = 1234.0, .from = {}, .take_up = {}},
                  [&](Result<MoveOutcome> outcome) { moved = std::move(outcome); });
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Code::Superseded);
  bench.RunUntil([&] { return moved.has_value(); }, 10s);
  ASSERT_TRUE(moved && *moved) << moved->error().message;
  EXPECT_TRUE((*moved)->reached);
  EXPECT_EQ(bench.Now(), before);
}

TEST(SearchConditions, ANewerCommandForTheIrisIsLeftAlone) {
  Bench bench(SceneOf(kWall));
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  std::optional<Result<MoveOutcome>> moved;
  bench.rig->Move(Axis::Iris, {.kind = Target::Kind::Native, .value = 77.0, .from = {}, .take_up = {}},
                  [&](Result<MoveOutcome> outcome) { moved = std::move(outcome); });
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_NE(answer.error().message.find("the iris is left where it is"), std::string::npos) << answer.error().message;
  bench.RunUntil([&] { return moved.has_value(); }, 10s);
  ASSERT_TRUE(moved && *moved) << moved->error().message;
  EXPECT_EQ(bench.Now().iris, 77.0);
}

}  // namespace
}  // namespace lensd::rig
