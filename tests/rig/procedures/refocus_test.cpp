// A lens that drifts with the temperature, looked after through simulated days: judged by where the simulator's
// mechanism and subject truly are.
#include "rig/refocus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "rig_on_sim.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using drivers::Axis;
using testing::RigOnSim;
using RefocusEnd = RefocusOutcome::End;

constexpr double kSubjectD = 1.0 / 1.2;
constexpr double kDriftUm = 2.5;  ///< extension gained a degree

std::string Scene(const std::string& lens = "", const std::string& more = "") {
  return "version = 1\n[camera]\nwidth = 192\nheight = 192\nexposure_ms = 8\nframe_rate_hz = 60\nbits = 10\n"
         "full_well_e = 10000\nread_noise_e = 3.0\n[lens]\nf_number = [2.8, 16.0]\nextension_mm = [0.0, 1.2]\n"
         "steps = 8192\nspeed_steps_per_s = 20000\ninitial_f_number = 2.8\ndrift_um_per_c = " +
         std::to_string(kDriftUm) + "\n" + lens +
         "[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\ntexture = \"" LENSD_SOURCE_DIR
         "/scenes/textures/brick.png\"\n[truth]\nregion = [0.1, 0.1, 0.8, 0.8]\n" +
         more;
}

RefocusConfig ByTemperature(double degrees) {
  RefocusConfig config;
  config.temperature = Celsius{degrees};
  config.move_within = Metres{1.5e-6};
  config.minimum_interval = 60s;
  return config;
}

/// A lens, and who looks after it.
class Kept : public RigOnSim {
 public:
  explicit Kept(const RefocusConfig& config, const std::string& scene = Scene(), std::uint64_t seed = 1)
      : RigOnSim(scene, seed, 3000, [](auto& made) { made.temperature.most_per_minute = 1e6; }), keeper(config, {}) {}

  void Warm(double by_c, const char* kind = "warmth") {
    ASSERT_TRUE(simulation->Inject({.kind = kind, .axis = {}, .lasts = {}, .steps = {}, .factor = {}, .by_c = by_c}));
  }
  void Focus(const std::string& method = "auto") {
    std::optional<Result<AutofocusOutcome>> found;
    AutofocusRequest request;
    request.method = method;
    rig->Autofocus(request, nullptr, [&](Result<AutofocusOutcome> outcome) { found = std::move(outcome); });
    RunUntil([&] { return found.has_value(); }, 5min);
    ASSERT_TRUE(found && *found && (*found)->focused);
    Due();  // as the daemon, which hears of the state before the answer
    keeper.Found(request, **found, rig->GetStatus(), clock.Now(), "");
    Watch();
  }
  void Watch() {
    if (!keeper.watch()) return;
    const auto shown = rig->View(ViewerOf(*rig, *keeper.reached(), keeper.config(), keeper.watch()));
    ASSERT_TRUE(shown);
  }
  void MoveBy(double steps) {
    std::optional<Result<MoveOutcome>> moved;
    rig->Move(Axis::Focus, {.kind = Target::Kind::NativeRelative, .value = steps, .from = {}, .take_up = {}},
              [&](Result<MoveOutcome> outcome) { moved = std::move(outcome); });
    RunUntil([&] { return moved.has_value(); }, 10s);
  }
  std::optional<RefocusOrder> Due() { return keeper.Due(rig->GetStatus(), clock.Now(), waits); }
  /// Steps on, and does what is due, for that long.
  void Keep(Duration how_long) {
    const Instant end = clock.Now() + how_long;
    while (clock.Now() < end) {
      Run(std::min<Duration>(1s, end - clock.Now()));
      auto order = Due();
      if (!order) continue;
      std::optional<Result<RefocusOutcome>> ended;
      causes.push_back(order->cause);
      Refocus(*rig, *std::move(order), [&](Result<RefocusOutcome> outcome) { ended = std::move(outcome); });
      RunUntil([&] { return ended.has_value(); }, 5min);
      ASSERT_TRUE(ended);
      keeper.Ended(*ended, rig->GetStatus(), clock.Now(), "");
      if (*ended) ++ends[(*ended)->end];
      last = *std::move(ended);
      if (last && last->end == RefocusEnd::Searched) Watch();
    }
  }
  /// By how much extension focus stands beside the subject.
  double OffUm() const {
    const sim::TrueState state = truth->Now();
    const double to_sensor = state.optics.sensor_distance_m;
    return 1e6 * (state.focal_plane_d - kSubjectD) * to_sensor * to_sensor;
  }

  RefocusKeeper keeper;
  std::string waits;
  std::map<RefocusEnd, int> ends;
  std::vector<RefocusCause> causes;
  Result<RefocusOutcome> last = Fail(Code::Internal, "none");
};

/// The hall cools at night and warms by day: 12 degrees between.
double OfDay(double hours) {
  return -6.0 * std::cos(2.0 * std::numbers::pi * (hours - 4.0) / 24.0);
}

TEST(RefocusByTemperature, ADriftingLensStaysInFocusThroughADay) {
  Kept lens(ByTemperature(0.5));
  lens.Warm(OfDay(0.0));
  lens.Focus();
  const double at_first = std::abs(lens.OffUm()), first = OfDay(0.0);
  double worst = 0.0, alone = 0.0;
  for (int tick = 0; tick < 24 * 12; ++tick) {
    const double by_c = OfDay(tick / 12.0);
    lens.Warm(by_c);
    lens.Keep(5min);
    worst = std::max(worst, std::abs(lens.OffUm()));
    alone = std::max(alone, kDriftUm * std::abs(by_c - first));
  }
  const auto& drift = lens.keeper.drift();
  ASSERT_TRUE(drift) << drift.error().message;
  std::printf(
      "12 C, %.1f um/C: at most %.2f um off, %.2f at first (alone %.1f), %d moves, %d searches; learned %.3f, "
      "%.3f..%.3f\n",
      kDriftUm, worst, at_first, alone, lens.ends[RefocusEnd::Moved], lens.ends[RefocusEnd::Searched],
      1e6 * drift->per_degree.value, 1e6 * drift->low.value, 1e6 * drift->high.value);
  EXPECT_GT(lens.ends[RefocusEnd::Moved], 2 * lens.ends[RefocusEnd::Searched]);
  EXPECT_EQ(lens.ends[RefocusEnd::Refused] + lens.ends[RefocusEnd::Failed], 0);
  EXPECT_LE(drift->low.value, 1e-6 * kDriftUm);
  EXPECT_GE(drift->high.value, 1e-6 * kDriftUm);
  EXPECT_LT(worst, std::min(at_first, 4.8) + 1.5);  // it keeps what a person focused; a pixel of blur is 9.7 um
}

TEST(RefocusByTemperature, AWrongThermometerNeverMovesItFarByWhatWasLearned) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  for (const double by_c : {1.5, 3.0, 4.5, 6.0, 4.0, 2.0, 0.0}) {
    lens.Warm(by_c);
    lens.Keep(3min);
  }
  ASSERT_TRUE(lens.keeper.drift());
  const int moves = lens.ends[RefocusEnd::Moved];
  lens.Warm(30.0, "wrong-temperature");  // nothing else has changed
  lens.Keep(10min);
  EXPECT_EQ(lens.ends[RefocusEnd::Moved], moves);
  EXPECT_EQ(lens.causes.back(), RefocusCause::Temperature);
  ASSERT_TRUE(lens.last);
  EXPECT_EQ(lens.last->end, RefocusEnd::Searched);
  EXPECT_THAT(lens.last->reason, ::testing::HasSubstr("too far from what was learned from"));
  EXPECT_LT(std::abs(lens.OffUm()), 1.0);
  // The result at the wrong temperature is no part of what is known.
  ASSERT_TRUE(lens.keeper.drift());
  EXPECT_TRUE(lens.keeper.learned().back().outlier);
  EXPECT_LE(lens.keeper.drift()->low.value, 1e-6 * kDriftUm);
  EXPECT_GE(lens.keeper.drift()->high.value, 1e-6 * kDriftUm);
}

TEST(RefocusByTemperature, AThermometerThatStandsStillStartsNothing) {
  Kept lens(ByTemperature(1.0));
  lens.Warm(-21.0, "wrong-temperature");
  lens.Focus();
  const double before = lens.OffUm();
  lens.Warm(4.0);
  lens.Warm(-25.0, "wrong-temperature");
  lens.Keep(10min);
  EXPECT_TRUE(lens.causes.empty());
  EXPECT_NEAR(std::abs(lens.OffUm() - before), 4.0 * kDriftUm, 0.5);
}

TEST(RefocusWaits, ForAHold) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  const double before = lens.rig->GetStatus().axes[Axis::Focus]->position.value;
  (void)lens.rig->Hold(lens.clock.Now() + 20min);
  lens.Warm(4.0);
  lens.Keep(19min);
  EXPECT_TRUE(lens.causes.empty());
  EXPECT_EQ(lens.keeper.why_not(), "the lens is held");
  EXPECT_EQ(lens.rig->GetStatus().axes[Axis::Focus]->position.value, before);
  lens.Keep(2min);
  ASSERT_EQ(lens.causes.size(), 1u);
  EXPECT_LT(std::abs(lens.OffUm()), 1.0);
}

TEST(RefocusWaits, AsLongAsItIsToldToAndBetweenTwo) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  lens.waits = "the lens is leased to somebody";
  lens.Warm(2.0);
  lens.Keep(5min);
  EXPECT_TRUE(lens.causes.empty());
  lens.waits.clear();
  lens.Keep(5s);
  ASSERT_EQ(lens.causes.size(), 1u);
  lens.Warm(4.0);
  lens.Keep(50s);
  EXPECT_EQ(lens.causes.size(), 1u);
  EXPECT_EQ(lens.keeper.why_not(), "the last one was too short a time ago");
  lens.Keep(30s);
  EXPECT_EQ(lens.causes.size(), 2u);
}

TEST(RefocusEnds, WithAStopInTheMiddle) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  lens.Warm(4.0);
  lens.Run(70s);
  auto order = lens.Due();
  ASSERT_TRUE(order);
  std::optional<Result<RefocusOutcome>> ended;
  Refocus(*lens.rig, *std::move(order), [&](Result<RefocusOutcome> outcome) { ended = std::move(outcome); });
  lens.Run(500ms);
  ASSERT_FALSE(ended);
  lens.rig->Stop({}, [](const Result<void>&) {});
  lens.RunUntil([&] { return ended.has_value(); }, 5s);
  ASSERT_TRUE(ended && !*ended);
  EXPECT_EQ(ended->error().code, Code::Cancelled);
  lens.keeper.Ended(*ended, lens.rig->GetStatus(), lens.clock.Now(), "");
  lens.Run(1s);
  const double stopped = lens.rig->GetStatus().axes[Axis::Focus]->position.value;
  lens.Warm(8.0);
  lens.Keep(10min);
  EXPECT_TRUE(lens.causes.empty());
  EXPECT_EQ(lens.rig->GetStatus().axes[Axis::Focus]->position.value, stopped);
  EXPECT_THAT(lens.keeper.why_not(), ::testing::HasSubstr("stopped"));
  lens.Focus();  // from here on again
  lens.Warm(12.0);
  lens.Keep(2min);
  EXPECT_EQ(lens.causes.size(), 1u);
}

TEST(RefocusEnds, WhereAPersonHasFocused) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  lens.MoveBy(50);
  const double there = lens.rig->GetStatus().axes[Axis::Focus]->position.value;
  lens.Warm(6.0);
  lens.Keep(10min);
  EXPECT_TRUE(lens.causes.empty());
  EXPECT_EQ(lens.rig->GetStatus().axes[Axis::Focus]->position.value, there);
  EXPECT_THAT(lens.keeper.why_not(), ::testing::HasSubstr("moved by a command"));
}

TEST(RefocusEnds, NotWithACommandThatIsRefused) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  const auto refused = [&](auto ask) {
    bool answered = false, failed = false;
    ask([&](const auto& outcome) { answered = true, failed = !outcome; });
    lens.RunUntil([&] { return answered; }, 5s);
    EXPECT_TRUE(answered && failed);
  };
  refused([&](auto done) {
    lens.rig->Move(Axis::Focus, {.kind = Target::Kind::Native, .value = 1e9, .from = {}, .take_up = {}}, done);
  });
  AutofocusRequest nonsense;
  nonsense.method = "nosuch";
  refused([&](auto done) { lens.rig->Autofocus(nonsense, nullptr, done); });
  lens.Warm(4.0);
  lens.Keep(2min);
  EXPECT_EQ(lens.causes.size(), 1u);
  EXPECT_LT(std::abs(lens.OffUm()), 2.0);
}

TEST(RefocusEnds, NotWithAnotherAxisThatIsMovedInTheMiddle) {
  Kept lens(ByTemperature(1.0));
  lens.Focus();
  lens.Warm(4.0);
  lens.Run(70s);
  auto order = lens.Due();
  ASSERT_TRUE(order);
  const double stood = lens.rig->GetStatus().axes[Axis::Focus]->position.value;
  std::optional<Result<RefocusOutcome>> ended;
  Refocus(*lens.rig, *std::move(order), [&](Result<RefocusOutcome> outcome) { ended = std::move(outcome); });
  lens.Run(500ms);
  ASSERT_FALSE(ended);
  lens.rig->Move(Axis::Iris, {.kind = Target::Kind::FNumber, .value = 4.0, .from = {}, .take_up = {}},
                 [](const Result<MoveOutcome>&) {});
  lens.RunUntil([&] { return ended.has_value(); }, 30s);
  ASSERT_TRUE(ended && *ended);
  EXPECT_THAT((*ended)->reason, ::testing::HasSubstr("back where it was"));
  EXPECT_NEAR(lens.rig->GetStatus().axes[Axis::Focus]->position.value, stood, 1.0);
  lens.keeper.Ended(*ended, lens.rig->GetStatus(), lens.clock.Now(), "");
  lens.Keep(5min);
  EXPECT_EQ(lens.causes.size(), 1u) << lens.keeper.why_not();
  EXPECT_LT(std::abs(lens.OffUm()), 2.0);
}

/// Autofocus that somebody asks for tells as much as lensd's own, as long as nothing else moves focus in between.
TEST(RefocusLearns, FromAutofocusThatSomebodyAsksFor) {
  Kept lens(ByTemperature(100.0));
  lens.Focus();
  EXPECT_TRUE(lens.keeper.learned().empty());  // by depth from defocus, which says too little
  for (const double by_c : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
    lens.Warm(by_c);
    lens.Focus("sweep");
    lens.Keep(10s);
  }
  ASSERT_EQ(lens.keeper.learned().size(), 6u);
  for (const DriftSample& sample : lens.keeper.learned())
    EXPECT_EQ(sample.subject, lens.keeper.learned().front().subject);
  EXPECT_TRUE(lens.keeper.drift());
  lens.MoveBy(300);
  lens.Focus("sweep");
  EXPECT_EQ(lens.keeper.learned().back().subject, lens.keeper.learned().front().subject + 1);
}

TEST(RefocusByTime, SearchesAnew) {
  RefocusConfig config;
  config.every = 30min;
  Kept lens(config);
  lens.Focus();
  lens.Warm(3.0);
  lens.Keep(29min);
  EXPECT_TRUE(lens.causes.empty());
  lens.Keep(2min);
  ASSERT_EQ(lens.causes, std::vector{RefocusCause::Time});
  EXPECT_LT(std::abs(lens.OffUm()), 1.0);
  lens.Keep(31min);
  EXPECT_EQ(lens.causes.size(), 2u);
}

TEST(RefocusBySharpness, AKnockIsSeenAndADarkerLampIsNone) {
  RefocusConfig config;
  config.sharpness_loss = 0.3;
  config.look_every = 5s;
  Kept lens(config);
  lens.Focus();
  lens.Keep(2min);
  EXPECT_TRUE(lens.causes.empty());
  // Half the light, as of a lamp that goes dim.
  ASSERT_TRUE(lens.rig->SetExposure({.exposure = 4ms, .gain = {}}));
  lens.Keep(5min);
  EXPECT_TRUE(lens.causes.empty());
  // It knows nothing of where it was knocked to.
  ASSERT_TRUE(lens.simulation->Inject({.kind = "jump", .axis = {}, .lasts = {}, .steps = 400, .factor = {}}));
  lens.Run(100ms);
  const double knocked = lens.OffUm();
  lens.Keep(2min);
  ASSERT_EQ(lens.causes, std::vector{RefocusCause::Sharpness});
  std::printf("knocked %.1f um off, then %.2f um\n", knocked, lens.OffUm());
  EXPECT_GT(std::abs(knocked), 30.0);
  EXPECT_LT(std::abs(lens.OffUm()), 2.0);
  lens.Keep(10min);
  EXPECT_EQ(lens.causes.size(), 1u);
}

class RefocusByFilter : public ::testing::TestWithParam<RefocusConfig::OnFilter> {};

TEST_P(RefocusByFilter, FocusIsWhereTheFilterHasIt) {
  RefocusConfig config;
  config.filter = GetParam();
  config.minimum_interval = 1s;
  Kept lens(config, Scene("filter_focus_um = [0, 45]\n"));
  if (GetParam() == RefocusConfig::OnFilter::Shift) {
    auto calibration = std::make_shared<Calibration>();
    FocusShift shift;
    shift.filters.emplace(Native{1}, Native{2});
    shift.size = {.native = false, .value = 45e-6, .sigma = 0.2e-6};
    calibration->Put(shift);
    lens.rig->SetCalibration(calibration, [](const Result<void>&) {});
    lens.Run(1s);
  }
  lens.Focus();
  for (const double filter : {2.0, 1.0}) {
    std::optional<Result<MoveOutcome>> moved;
    lens.rig->Move(Axis::Filter, {.kind = Target::Kind::Native, .value = filter, .from = {}, .take_up = {}},
                   [&](Result<MoveOutcome> outcome) { moved = std::move(outcome); });
    lens.RunUntil([&] { return moved.has_value(); }, 10s);
    EXPECT_GT(std::abs(lens.OffUm()), 30.0);
    lens.Keep(30s);
    EXPECT_LT(std::abs(lens.OffUm()), 9.5);  // half of half a depth of field: autofocus itself stops up to 8 um short
  }
  const RefocusEnd end = GetParam() == RefocusConfig::OnFilter::Shift ? RefocusEnd::Moved : RefocusEnd::Searched;
  EXPECT_EQ(lens.ends[end], 2);
  EXPECT_EQ(lens.causes, std::vector(2, RefocusCause::Filter));
}
INSTANTIATE_TEST_SUITE_P(Both, RefocusByFilter,
                         ::testing::Values(RefocusConfig::OnFilter::Shift, RefocusConfig::OnFilter::Search),
                         [](const auto& on) {
                           return on.param == RefocusConfig::OnFilter::Shift ? "Shift" : "Search";
                         });

TEST(RefocusConfiguration, WhatALensCannotDoIsSaid) {
  RefocusConfig config = ByTemperature(1.0);
  config.every = 1h;
  config.filter = RefocusConfig::OnFilter::Search;
  config.sharpness_loss = 0.5;
  EXPECT_EQ(WhatRefocusLacks(config, {}).size(), 4u);
  EXPECT_TRUE(WhatRefocusLacks(config, {.thermometer = true, .filter = true, .camera = true}).empty());
}

}  // namespace
}  // namespace lensd::rig
