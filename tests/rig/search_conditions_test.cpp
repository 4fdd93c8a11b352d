// Searches under conditions of their own on the simulated lens: what its truth says of the focus afterwards, and that
// exposure, iris and filter are as before at every end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "io/toml.h"
#include "rig/focus_shift_run.h"
#include "rig_on_sim.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using drivers::Axis;
using testing::RigOnSim;

constexpr double kWidest = 2.8, kWork = 8.0;
constexpr double kShiftUm = 60.0;  // that the widest opening needs more
constexpr double kFilterUm = 45.0;
constexpr double kSubjectD = 1.0 / 1.2;

std::string SceneOf(const std::string& surface) {
  return "version = 1\n[camera]\nwidth = 256\nheight = 256\nexposure_ms = 8\nframe_rate_hz = 200\n"
         "full_well_e = 10000\nread_noise_e = 3.0\nbits = 12\n"
         "[lens]\nfocal_length_mm = 25.0\nf_number = [2.8, 16.0]\nextension_mm = [0.0, 1.2]\nsteps = 8192\n"
         "speed_steps_per_s = 20000\ninitial_f_number = 8.0\nfocus_shift_um = 60\nfilter_focus_um = [0, 45]\n"
         "[[surface]]\nkind = \"wall\"\n" +
         surface + "\n[truth]\nregion = [0.1, 0.1, 0.8, 0.8]\n";
}
const std::string kWall = "distance_m = 1.2\ntexture = \"" LENSD_SOURCE_DIR "/scenes/textures/brick.png\"";
const std::string kBlank = "distance_m = 1.2\nconstant = 0.5";

SearchConditions WideOpen() {
  SearchConditions conditions;
  conditions.exposure.exposure = 1ms;
  conditions.f_number = FNumber{kWidest};
  return conditions;
}

/// What a lens stands at but for focus.
struct Stand {
  double iris = 0.0, filter = 0.0;
  Duration exposure{};
  bool operator==(const Stand&) const = default;
};

class Bench : public RigOnSim {
 public:
  explicit Bench(const std::string& scene, std::uint64_t seed = 1,
                 std::shared_ptr<const Calibration> calibration = nullptr)
      : RigOnSim(scene, seed, 3000, {}, std::move(calibration)) {
    // It begins between two steps, where no motor can go back to.
    for (const double step : {50.0, 60.0})
      Move(Axis::Iris, {.kind = Target::Kind::Native, .value = step, .from = {}, .take_up = {}});
  }
  void Move(Axis axis, const Target& target) {
    std::optional<Result<MoveOutcome>> moved;
    rig->Move(axis, target, [&](Result<MoveOutcome> outcome) { moved = std::move(outcome); });
    RunUntil([&] { return moved.has_value(); }, 10s);
    EXPECT_TRUE(moved && *moved && (*moved)->reached);
  }
  Stand Now() {
    const Status status = rig->GetStatus();
    return {status.axes[Axis::Iris]->position.value, status.axes[Axis::Filter]->position.value,
            *rig->SetExposure({})->exposure};
  }
  void Begin(const SearchConditions& conditions) {
    AutofocusRequest request;
    request.conditions = conditions;
    Begin(std::move(request));
  }
  void Begin(AutofocusRequest request) {
    rig->Autofocus(std::move(request), nullptr, [this](Result<AutofocusOutcome> ended) { answer = std::move(ended); });
  }
  const Result<AutofocusOutcome>& End() {
    RunUntil([this] { return answer.has_value(); }, std::chrono::minutes(5));
    if (!answer) answer = Fail(Code::Internal, "no answer");
    return *answer;
  }
  /// Steps on until the search itself has begun: the iris stands where it is wanted.
  void RunIntoTheSearch() {
    RunUntil([this] { return rig->GetStatus().activity.step > 0; }, 10s);
    ASSERT_GT(rig->GetStatus().activity.step, 0);
    ASSERT_LT(rig->GetStatus().f_number->value, 3.0);
  }
  double OffUm() const {
    const sim::TrueState state = truth->Now();
    const double to_sensor = state.optics.sensor_distance_m;
    return 1e6 * (state.focal_plane_d - kSubjectD) * to_sensor * to_sensor;
  }
  std::optional<Result<AutofocusOutcome>> answer;
};

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
