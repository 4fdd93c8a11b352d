// Searches under conditions of their own on the simulated lens: what its truth says of the focus afterwards, and that
// exposure, iris and filter are as before at every end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "io/toml.h"
#include "rig/focus_shift_run.h"
#include "tests/rig/search_conditions_bench.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

FocusShift Measure(const SearchConditions& conditions, std::uint64_t seed) {
  Bench bench(SceneOf(kWall), seed);
  std::optional<Result<ShiftOutcome>> answer;
  MeasureFocusShift(*bench.rig, {.conditions = conditions}, nullptr,
                    [&](Result<ShiftOutcome> outcome) { answer = std::move(outcome); });
  bench.RunUntil([&] { return answer.has_value(); }, std::chrono::minutes(10));
  EXPECT_TRUE(answer && *answer) << (answer ? answer->error().message : "no answer");
  if (!answer || !*answer) return {};
  EXPECT_TRUE((*answer)->measured) << (*answer)->reason;
  return (*answer)->shift;
}

std::shared_ptr<Calibration> Knowing(const FocusShift& shift) {
  auto calibration = std::make_shared<Calibration>();
  calibration->Put(shift);
  return calibration;
}

/// What a scene's key makes of an f-number.
double NeededUm(double f_number) {
  return kShiftUm * std::pow(kWidest / f_number, 2);
}

// ---- the shift ----------------------------------------------------------------------------------------------------

TEST(SearchConditions, TheShiftIsMeasuredAndItsSigmaIsTrue) {
  constexpr int kRuns = 12;
  int within = 0;
  double worst = 0.0, sigmas = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const FocusShift shift = Measure(WideOpen(), 10 + static_cast<std::uint64_t>(run));
    ASSERT_TRUE(shift.f_numbers);
    const double truth = NeededUm(shift.f_numbers->second.value) - NeededUm(shift.f_numbers->first.value);
    const double error = 1e6 * shift.size.value - truth, sigma = 1e6 * shift.size.sigma;
    within += std::abs(error) <= 2.0 * sigma;
    worst = std::max(worst, std::abs(error));
    sigmas += sigma / kRuns;
  }
  std::printf("%d of %d within 2 sigma, mean sigma %.2f um, worst %.2f um\n", within, kRuns, sigmas, worst);
  EXPECT_GE(within, 9);  // 95 % on average
  EXPECT_LT(worst, 0.5);
}

TEST(SearchConditions, FocusGoesOnByTheShiftThatWasMeasured) {
  const FocusShift shift = Measure(WideOpen(), 3);
  Bench bench(SceneOf(kWall), 4, Knowing(shift));
  const Stand before = bench.Now();
  bench.Begin(WideOpen());
  const auto& answer = bench.End();
  ASSERT_TRUE(answer) << answer.error().message;
  ASSERT_TRUE(answer->focused) << answer->reason;
  ASSERT_TRUE(answer->under && answer->under->shift);
  EXPECT_EQ(bench.Now(), before);
  EXPECT_EQ(answer->under->stays, "");
  EXPECT_NEAR(answer->under->search.f_number->value, kWidest, 0.05);
  EXPECT_EQ(answer->under->exposure.exposure, 1ms);
  // Without the shift it would be some 53 um off; two pixels of blur at f/8 are 55 um.
  EXPECT_LT(std::abs(bench.OffUm()), 8.0);
  EXPECT_GT(std::abs(NeededUm(kWork) - NeededUm(kWidest)), 50.0);
  EXPECT_NEAR(answer->vergence->value, kSubjectD, 4.0 * answer->sigma->value);
  // What is not known of the shift is not known of the answer.
  const double to_sensor = bench.truth->Now().optics.sensor_distance_m;
  EXPECT_GE(answer->sigma->value, shift.size.sigma / (to_sensor * to_sensor));
  EXPECT_NEAR(answer->subject->vergence->value, answer->vergence->value, 0.01);
}

TEST(SearchConditions, AShiftOfFiltersCountsEitherWayRound) {
  SearchConditions second;
  second.filter = Native{2.0};
  const FocusShift shift = Measure(second, 5);
  ASSERT_TRUE(shift.filters);
  EXPECT_NEAR(1e6 * shift.size.value, -kFilterUm, 2.0);
  Bench bench(SceneOf(kWall), 6, Knowing(shift));
  bench.Move(Axis::Filter, {.kind = Target::Kind::Native, .value = 2.0, .from = {}, .take_up = {}});
  SearchConditions first;
  first.filter = Native{1.0};
  bench.Begin(first);
  ASSERT_TRUE(bench.End()) << bench.answer->error().message;
  const AutofocusOutcome& answer = **bench.answer;
  ASSERT_TRUE(answer.focused) << answer.reason;
  ASSERT_TRUE(answer.under->shift);
  EXPECT_DOUBLE_EQ(answer.under->shift->value, -shift.size.value);
  EXPECT_EQ(bench.Now().filter, 2.0);
  EXPECT_LT(std::abs(bench.OffUm()), 20.0);
}

TEST(SearchConditions, AShiftThatWasNotMeasuredIsSaidSo) {
  Bench bench(SceneOf(kWall), 7);
  bench.Begin(WideOpen());
  const auto& answer = bench.End();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_TRUE(answer->focused) << answer->reason;
  EXPECT_FALSE(answer->under->shift);
  EXPECT_NE(answer->under->shift_reason.find("is not measured"), std::string::npos) << answer->under->shift_reason;
  EXPECT_NE(answer->reason.find("from f/2.8"), std::string::npos) << answer->reason;
  EXPECT_GT(std::abs(bench.OffUm()), 40.0);
}

TEST(SearchConditions, AnExposureAloneShiftsNothing) {
  Bench bench(SceneOf(kWall), 8);
  const Stand before = bench.Now();
  SearchConditions brief;
  brief.exposure.exposure = 3ms;
  bench.Begin(brief);
  const auto& answer = bench.End();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_TRUE(answer->focused) << answer->reason;
  ASSERT_TRUE(answer->under->shift);
  EXPECT_EQ(answer->under->shift->value, 0.0);
  EXPECT_EQ(bench.Now(), before);
}

// ---- every end ----------------------------------------------------------------------------------------------------

TEST(SearchConditions, ARefusalBringsAllBack) {
  Bench bench(SceneOf(kBlank));
  const Stand before = bench.Now();
  SearchConditions conditions = WideOpen();
  conditions.filter = Native{2.0};
  bench.Begin(conditions);
  const auto& answer = bench.End();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_FALSE(answer->focused);
  EXPECT_EQ(answer->under->stays, "");
  EXPECT_EQ(bench.Now(), before);
  EXPECT_NEAR(bench.rig->GetStatus().axes[Axis::Focus]->position.value, 3000.0, 1.0);
}

TEST(SearchConditions, TheDeadlineBringsAllBack) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  AutofocusRequest request;
  request.conditions = WideOpen();
  request.method = "exhaustive";
  request.deadline = 900ms;
  bench.Begin(std::move(request));
  const auto& answer = bench.End();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->cause, autofocus::Cause::Deadline) << answer->reason;
  EXPECT_EQ(bench.Now(), before);
}

TEST(SearchConditions, WhatDoesNotComeBackIsNeverDone) {
  Bench bench(SceneOf(kWall));
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  ASSERT_TRUE(bench.simulation->Inject({.kind = "stall", .axis = Axis::Iris, .lasts = {}, .steps = {}, .factor = {}}));
  const auto& answer = bench.End();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_FALSE(answer->focused);
  EXPECT_EQ(answer->cause, autofocus::Cause::NotRestored) << answer->reason;
  EXPECT_NE(answer->under->stays.find("the iris did not come back to f/8"), std::string::npos) << answer->under->stays;
  EXPECT_EQ(bench.Now().exposure, 8ms);
}

TEST(SearchConditions, ALensThatIsGoneSaysWhatStays) {
  Bench bench(SceneOf(kWall));
  bench.Begin(WideOpen());
  bench.RunIntoTheSearch();
  ASSERT_TRUE(bench.simulation->Inject({.kind = "disconnect", .axis = {}, .lasts = 3s, .steps = {}, .factor = {}}));
  const auto& answer = bench.End();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, Code::Disconnected) << answer.error().message;
  EXPECT_NE(answer.error().message.find("the iris did not come back"), std::string::npos) << answer.error().message;
}

// ---- what cannot be -----------------------------------------------------------------------------------------------

TEST(SearchConditions, WhatTheLensCannotBeBroughtToIsRefusedBeforeAnythingMoves) {
  Bench bench(SceneOf(kWall));
  const Stand before = bench.Now();
  const auto refused = [&](const SearchConditions& conditions, Code code, const std::string& parameter) {
    bench.answer.reset();
    bench.Begin(conditions);
    const auto& answer = bench.End();
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().code, code) << answer.error().message;
    ASSERT_TRUE(answer.error().facts);
    EXPECT_EQ(answer.error().facts->parameter, parameter);
    EXPECT_EQ(bench.Now(), before);
  };
  SearchConditions wider = WideOpen();
  wider.f_number = FNumber{1.0};
  refused(wider, Code::OutOfRange, "conditions.fNumber");
  SearchConditions third = WideOpen();
  third.filter = Native{3.0};
  refused(third, Code::OutOfRange, "conditions.filterPosition");
  SearchConditions endless;
  endless.exposure.exposure = -1ms;
  refused(endless, Code::OutOfRange, "conditions.exposureMs");
}

TEST(SearchConditions, ItIsAnAutofocusFromItsFirstMoveOn) {
  Bench bench(SceneOf(kWall));
  bench.Begin(WideOpen());
  bench.Run(20ms);
  EXPECT_EQ(bench.rig->GetStatus().activity.kind, Activity::Kind::Autofocus);
  ASSERT_TRUE(bench.rig->WhyNotFocused());
  const auto exposed = bench.rig->SetExposure({.exposure = 5ms, .gain = {}});
  ASSERT_FALSE(exposed);
  EXPECT_EQ(exposed.error().code, Code::Busy);
  (void)bench.End();
  EXPECT_FALSE(bench.rig->WhyNotFocused());
  EXPECT_EQ(bench.rig->GetStatus().activity.kind, Activity::Kind::Idle);
}

TEST(SearchConditions, ShiftsAreKeptAsTheyAre) {
  Calibration calibration;
  calibration.serial = "S";
  FocusShift opening;
  opening.f_numbers.emplace(FNumber{2.8}, FNumber{8.0});
  opening.size = {false, -52.65e-6, 0.8e-6};
  opening.runs = 5;
  opening.made = "2026-11-25";
  FocusShift filter;
  filter.filters.emplace(Native{1.0}, Native{2.0});
  filter.focal_length = Metres{35e-3};
  filter.size = {true, 12.5, 0.25};
  calibration.Put(opening);
  calibration.Put(filter);
  const auto settings = io::ParseToml(CalibrationText(calibration), "kept.toml");
  ASSERT_TRUE(settings);
  const auto read = ReadCalibration(*settings);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->focus_shifts.size(), 2u);
  EXPECT_TRUE(read->focus_shifts[0].SamePair(opening));
  EXPECT_DOUBLE_EQ(read->focus_shifts[0].size.value, opening.size.value);
  EXPECT_EQ(read->focus_shifts[0].made, "2026-11-25");
  EXPECT_TRUE(read->focus_shifts[1].SamePair(filter));
  EXPECT_TRUE(read->focus_shifts[1].size.native);
  EXPECT_EQ(read->focus_shifts[1].size.sigma, 0.25);
}

}  // namespace
}  // namespace lensd::rig
