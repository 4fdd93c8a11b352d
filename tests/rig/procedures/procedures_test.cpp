// Zoom with focus following, iris with brightness kept, presets, temperature: on the simulated lens, against its truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "io/toml.h"
#include "rig/exposure.h"
#include "rig/presets.h"
#include "rig/zoom.h"
#include "rig_on_sim.h"

namespace lensd::rig {
namespace {

using drivers::Axis;
using testing::RigOnSim;
using Kind = Target::Kind;

std::string SceneWith(const std::string& lens, const std::string& camera = "") {
  return "version = 1\n[camera]\nwidth = 64\nheight = 64\nexposure_ms = 2\nframe_rate_hz = 100\nbits = 12\n" + camera +
         "\n[lens]\nf_number = [1.4, 16.0]\nextension_mm = [0.0, 4.0]\nsteps = 8192\nspeed_steps_per_s = 20000\n" +
         lens + "\n[[surface]]\nkind = \"wall\"\ndistance_m = 1.2\nsinusoid_px = [8.0, 0.0]\n";
}
const std::string kZoom = "focal_length_mm = [25.0, 50.0]\n";

Target To(Kind kind, double value) {
  return {.kind = kind, .value = value, .from = {}, .take_up = {}};
}

MoveOutcome Move(RigOnSim& bench, Axis axis, const Target& target) {
  std::optional<Result<MoveOutcome>> answer;
  bench.rig->Move(axis, target, [&](Result<MoveOutcome> outcome) { answer = std::move(outcome); });
  bench.RunUntil([&] { return answer.has_value(); }, std::chrono::minutes(1));
  EXPECT_TRUE(answer && *answer) << (answer ? answer->error().message : "no answer");
  return answer && *answer ? **answer : MoveOutcome{};
}

std::shared_ptr<Calibration> BacklashOf(double steps, double low, double high) {
  auto calibration = std::make_shared<Calibration>();
  calibration->backlash[Axis::Focus] = Backlash{steps, low, high, true};
  return calibration;
}

// ---- zoom ---------------------------------------------------------------------------------------------------------

/// Sensor-side distance between where the sensor is and where `kept` would be sharp.
double Off(const sim::TrueState& state, double kept) {
  const double f = state.optics.focal_length_m;
  return std::abs(state.extension_m - f * f * kept / (1.0 - f * kept));
}

class Zoom : public ::testing::TestWithParam<std::tuple<double, double, double, double>> {};

TEST_P(Zoom, KeepsTheFocalPlaneWithinItsBoundAllTheWay) {
  const auto [backlash, known, from_mm, to_mm] = GetParam();
  const auto calibration = backlash > 0 ? BacklashOf(known, known - 3.0, known + 3.0) : nullptr;
  RigOnSim bench(SceneWith(kZoom + "backlash_steps = " + std::to_string(backlash)), 1, 0.0, {}, calibration);
  ASSERT_TRUE(Move(bench, Axis::Zoom, To(Kind::FocalLength, from_mm * 1e-3)).reached);
  ASSERT_TRUE(Move(bench, Axis::Focus, To(Kind::Distance, 1.2)).reached);
  const double kept = bench.rig->GetStatus().vergence->value;
  EXPECT_NEAR(kept, 1.0 / 1.2, 0.002);
  EXPECT_NEAR(bench.truth->Now().focal_plane_d, kept, 0.002);

  std::optional<Result<ZoomOutcome>> answer;
  ZoomKeepingFocus(*bench.rig, {.target = To(Kind::FocalLength, to_mm * 1e-3), .tolerance = {}},
                   [&](Result<ZoomOutcome> outcome) { answer = std::move(outcome); });
  double worst = 0.0;
  Duration waited{};
  for (; !answer; waited += std::chrono::milliseconds(1)) {
    bench.Run(std::chrono::milliseconds(1));
    worst = std::max(worst, Off(bench.truth->Now(), kept));
  }
  ASSERT_TRUE(*answer) << answer->error().message;
  const ZoomOutcome& outcome = **answer;
  EXPECT_TRUE(outcome.zoom.reached) << outcome.zoom.reason;
  EXPECT_LE(std::chrono::abs(outcome.zoom.elapsed - waited), std::chrono::milliseconds(5));  // the whole way's time
  EXPECT_NEAR(outcome.zoom.focal_length->value, to_mm * 1e-3, 0.013e-3);
  EXPECT_LT(worst, outcome.tracking_bound.value);
  // Two pixels of blur at f/2 are 13.8 um; what is not known of the backlash comes on top.
  EXPECT_LT(outcome.tracking_bound.value, 13.8e-6 + (backlash > 0 ? 8e-6 : 2e-6));
  EXPECT_NEAR(bench.truth->Now().focal_plane_d, kept, 0.002);
  std::printf("backlash %.0f, %g to %g mm: worst %.2f um of %.2f um in %d parts\n", backlash, from_mm, to_mm,
              worst * 1e6, outcome.tracking_bound.value * 1e6, outcome.steps);
}

INSTANTIATE_TEST_SUITE_P(Both, Zoom,
                         ::testing::Values(std::tuple(0.0, 0.0, 25.0, 50.0), std::tuple(0.0, 0.0, 50.0, 30.0),
                                           std::tuple(200.0, 200.0, 25.0, 50.0), std::tuple(200.0, 198.0, 50.0, 25.0),
                                           std::tuple(200.0, 202.0, 45.0, 26.0)));

TEST(ZoomTolerance, WhatIsFinerThanTheLensAllowsIsSaid) {
  RigOnSim bench(SceneWith(kZoom));
  double zoom_m = 0.030;
  for (const double tolerance_um : {0.01, 0.3, 2.0, 20.0}) {
    std::optional<Result<ZoomOutcome>> answer;
    ZoomKeepingFocus(*bench.rig,
                     {.target = To(Kind::FocalLength, zoom_m += 0.004), .tolerance = Metres{tolerance_um * 1e-6}},
                     [&](Result<ZoomOutcome> outcome) { answer = std::move(outcome); });
    while (!answer) bench.Run(std::chrono::milliseconds(10));
    ASSERT_TRUE(*answer) << answer->error().message;
    const bool kept = (*answer)->tracking_bound.value <= tolerance_um * 1e-6;
    EXPECT_EQ((*answer)->zoom.reason.find("tracking tolerance") == std::string::npos, kept) << tolerance_um;
    EXPECT_TRUE(tolerance_um > 0.1 || !kept);
    EXPECT_TRUE(tolerance_um < 10.0 || kept);
  }
}

TEST(ZoomKeepingFocus, RefusesWhatFocusCannotFollow) {
  RigOnSim bench(SceneWith(kZoom));
  ASSERT_TRUE(Move(bench, Axis::Focus, To(Kind::Distance, 0.4)).reached);  // at 50 mm that takes 7 mm of extension
  std::optional<Result<ZoomOutcome>> answer;
  ZoomKeepingFocus(*bench.rig, {.target = To(Kind::FocalLength, 0.05), .tolerance = {}},
                   [&](Result<ZoomOutcome> outcome) { answer = std::move(outcome); });
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->error().code, Code::OutOfRange);
  EXPECT_NEAR(bench.rig->GetStatus().focal_length->value, 0.025, 1e-9);
}

TEST(ZoomKeepingFocus, AStopEndsItWhereItIs) {
  RigOnSim bench(SceneWith(kZoom));
  ASSERT_TRUE(Move(bench, Axis::Focus, To(Kind::Distance, 1.2)).reached);
  std::optional<Result<ZoomOutcome>> answer;
  ZoomKeepingFocus(*bench.rig, {.target = To(Kind::FocalLength, 0.05), .tolerance = {}},
                   [&](Result<ZoomOutcome> outcome) { answer = std::move(outcome); });
  bench.Run(std::chrono::milliseconds(300));
  ASSERT_FALSE(answer);
  bench.rig->Stop({}, nullptr);
  bench.Run(std::chrono::milliseconds(200));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->error().code, Code::Cancelled);
  const double stopped_at = bench.rig->GetStatus().focal_length->value;
  bench.Run(std::chrono::seconds(2));
  EXPECT_EQ(bench.rig->GetStatus().focal_length->value, stopped_at);
}

TEST(ZoomKeepingFocus, WhatItDoesNotMoveMayBeStoppedAndMoved) {
  for (const bool moves : {false, true}) {
    RigOnSim bench(SceneWith(kZoom));
    ASSERT_TRUE(Move(bench, Axis::Focus, To(Kind::Distance, 1.2)).reached);
    std::optional<Result<ZoomOutcome>> answer;
    ZoomKeepingFocus(*bench.rig, {.target = To(Kind::FocalLength, 0.05), .tolerance = {}},
                     [&](Result<ZoomOutcome> outcome) { answer = std::move(outcome); });
    bench.Run(std::chrono::milliseconds(300));
    ASSERT_FALSE(answer);
    if (moves) {
      EXPECT_TRUE(Move(bench, Axis::Iris, To(Kind::FNumber, 4.0)).reached);
    } else {
      bench.rig->Stop({Axis::Iris}, nullptr);
    }
    bench.RunUntil([&] { return answer.has_value(); }, std::chrono::seconds(20));
    ASSERT_TRUE(answer && *answer) << answer->error().message;
    EXPECT_TRUE((*answer)->zoom.reached);
    EXPECT_NEAR(bench.truth->Now().focal_plane_d, 1.0 / 1.2, 0.002);
  }
}

// ---- homing -------------------------------------------------------------------------------------------------------

TEST(Homing, IsBelievedToReadingsThatDoNotChangeOnlyOnceItCanBeOver) {
  RigOnSim bench(SceneWith("") + "[[fault]]\nkind = \"stale-readback\"\nat_ms = 2000\n");
  std::optional<double> told_at;
  Duration took{};
  const auto home = [&] {
    told_at.reset();
    bench.rig->Home(Axis::Focus, [&](Result<MoveOutcome> outcome) {
      EXPECT_TRUE(outcome && outcome->reached);
      took = outcome ? outcome->elapsed : Duration{};
      told_at = bench.truth->Now().focus_steps;
    });
    bench.RunUntil([&] { return told_at.has_value(); }, std::chrono::minutes(1));
  };
  home();
  EXPECT_LE(took, std::chrono::milliseconds(150));  // it stands there, and there is nothing to see
  ASSERT_TRUE(Move(bench, Axis::Focus, To(Kind::Native, 8000)).reached);
  bench.Run(std::chrono::seconds(3));
  home();
  ASSERT_TRUE(told_at);
  EXPECT_NEAR(*told_at, 0.0, 1e-3);
}

// ---- exposure -----------------------------------------------------------------------------------------------------

double Brightness(RigOnSim& bench) {
  std::optional<Result<LensedFrame>> seen;
  bench.rig->Snapshot([&](Result<LensedFrame> frame) { seen = std::move(frame); });
  bench.RunUntil([&] { return seen.has_value(); }, std::chrono::seconds(20));
  const auto& samples = *(**seen).frame.samples;
  return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

Result<BrightMove> Iris(RigOnSim& bench, double f_number) {
  std::optional<Result<BrightMove>> answer;
  MoveIrisKeepingBrightness(*bench.rig, To(Kind::FNumber, f_number), 1.0,
                            [&](Result<BrightMove> outcome) { answer = std::move(outcome); });
  bench.RunUntil([&] { return answer.has_value(); }, std::chrono::seconds(20));
  return *answer;
}

TEST(Exposure, FollowsTheSquareOfTheWorkingFNumber) {
  RigOnSim bench(SceneWith("focal_length_mm = 25.0\niris_steps = 1000\n"));
  ASSERT_TRUE(Move(bench, Axis::Focus, To(Kind::Distance, 0.3)).reached);
  ASSERT_TRUE(Move(bench, Axis::Iris, To(Kind::FNumber, 4.0)).reached);
  const double before = Brightness(bench);
  const auto stopped = Iris(bench, 5.6);
  ASSERT_TRUE(stopped) << stopped.error().message;
  EXPECT_EQ(stopped->reason, "");
  EXPECT_NEAR(Brightness(bench) / before, 1.0, 0.01);
  EXPECT_NEAR(std::chrono::duration<double>(stopped->exposure->exposure).count(), 2e-3 * 1.96, 0.02e-3);
  const auto opened = Iris(bench, 2.8);
  ASSERT_TRUE(opened);
  EXPECT_NEAR(Brightness(bench) / before, 1.0, 0.01);
}

TEST(Exposure, SaysWhereTheCameraCannotFollow) {
  RigOnSim bench(SceneWith("focal_length_mm = 25.0\n"));
  const double before = Brightness(bench);
  const auto stopped = Iris(bench, 16.0);  // 64 times 2 ms is longer than a frame of 10 ms
  ASSERT_TRUE(stopped);
  EXPECT_TRUE(stopped->move.reached);
  EXPECT_NEAR(Brightness(bench) / before, 5.0 / 64.0, 0.005);
  EXPECT_NEAR(stopped->exposure->ratio, 5.0 / 64.0, 0.002);
  EXPECT_NE(stopped->reason.find("3.678 stops darker"), std::string::npos) << stopped->reason;
}

TEST(Exposure, OfAnyCamera) {
  drivers::CameraCapabilities camera;
  const auto exposure = [&](double before_ms, double n, double after) {
    return ExposureFor(Duration(std::llround(before_ms * 1e6)), FNumber{n}, FNumber{after}, camera);
  };
  EXPECT_EQ(exposure(10, 2, 4).exposure, std::chrono::milliseconds(40));
  EXPECT_EQ(exposure(10, 2, 4).ratio, 1.0);
  camera.shortest_exposure = std::chrono::milliseconds(5);
  EXPECT_EQ(exposure(10, 4, 2).exposure, std::chrono::milliseconds(5));
  EXPECT_NEAR(exposure(10, 4, 2).ratio, 2.0, 1e-12);
  camera.longest_exposure = std::chrono::milliseconds(20);
  EXPECT_NEAR(exposure(10, 2, 4).ratio, 0.5, 1e-12);
}

// ---- presets ------------------------------------------------------------------------------------------------------

RecallOutcome Recall(RigOnSim& bench, const Preset& preset) {
  std::optional<Result<RecallOutcome>> answer;
  RecallPreset(*bench.rig, preset, [&](Result<RecallOutcome> outcome) { answer = std::move(outcome); });
  bench.RunUntil([&] { return answer.has_value(); }, std::chrono::minutes(1));
  EXPECT_TRUE(answer && *answer) << (answer ? answer->error().message : "no answer");
  return answer && *answer ? **answer : RecallOutcome{};
}

std::shared_ptr<Calibration> Warm(double um_per_c) {
  auto calibration = std::make_shared<Calibration>();
  calibration->temperature = TemperatureModel{Metres{um_per_c * 1e-6}, Metres{}, Celsius{20}, Celsius{0}, Celsius{40}};
  return calibration;
}

void Compensate(RigConfig& config) {
  config.temperature.compensate = true;
}

TEST(Presets, BringBackTheOpticalStateWhenItIsWarmer) {
  const std::string lens = kZoom + "drift_um_per_c = 3.0\n";
  RigOnSim cold(SceneWith(lens + "temperature_c = 12.0\n"), 1, 0.0, Compensate, Warm(3.0));
  ASSERT_TRUE(Move(cold, Axis::Zoom, To(Kind::FocalLength, 0.035)).reached);
  ASSERT_TRUE(Move(cold, Axis::Iris, To(Kind::FNumber, 5.6)).reached);
  ASSERT_TRUE(Move(cold, Axis::Focus, To(Kind::Distance, 1.0)).reached);
  const auto preset = TakePreset(*cold.rig, "door 1");
  ASSERT_TRUE(preset) << preset.error().message;
  const sim::TrueState saved = cold.truth->Now();

  RigOnSim warm(SceneWith(lens + "temperature_c = 31.0\n"), 1, 4000.0, Compensate, Warm(3.0));
  const RecallOutcome outcome = Recall(warm, *preset);
  EXPECT_TRUE(outcome.reached);
  EXPECT_EQ(outcome.moves.size(), 3u);
  const sim::TrueState now = warm.truth->Now();
  EXPECT_NEAR(now.optics.focal_length_m, saved.optics.focal_length_m, 1e-9);
  EXPECT_NEAR(now.f_number, saved.f_number, 1e-9);
  EXPECT_NEAR(now.focal_plane_d, saved.focal_plane_d, outcome.vergence_bound->value);
  EXPECT_LT(outcome.vergence_bound->value, 0.003);
  EXPECT_LT(now.focus_steps, saved.focus_steps - 100.0);  // not the same count

  // Without compensation the same recall is off, and its bound says by how much it may be.
  RigOnSim plain(SceneWith(lens + "temperature_c = 31.0\n"), 1, 4000.0, {}, Warm(3.0));
  const RecallOutcome off = Recall(plain, *preset);
  EXPECT_GT(std::abs(plain.truth->Now().focal_plane_d - saved.focal_plane_d), 0.01);
  EXPECT_NEAR(plain.truth->Now().focal_plane_d, saved.focal_plane_d, off.vergence_bound->value);
}

TEST(Presets, WithoutOpticsTheSamePlaceIsReachedFromTheOtherSide) {
  const std::string lens = "focal_length_mm = 25.0\nbacklash_steps = 212\n";
  const auto far = [](RigConfig& config) { config.axes[Axis::Focus].approach_near = false; };
  RigOnSim from_below(SceneWith(lens), 1, 0.0, {}, BacklashOf(212, 211, 213));
  ASSERT_TRUE(Move(from_below, Axis::Focus, To(Kind::Native, 2260)).reached);
  auto preset = TakePreset(*from_below.rig, "x");
  ASSERT_TRUE(preset);
  preset->vergence.reset();  // as of a lens whose optics are not known
  RigOnSim from_above(SceneWith(lens), 1, 5000.0, far, BacklashOf(212, 211, 213));
  const RecallOutcome outcome = Recall(from_above, *preset);
  EXPECT_TRUE(outcome.reached);
  EXPECT_EQ(outcome.moves.back().position.value, 2048);
  EXPECT_NEAR(from_above.truth->Now().focus_steps, from_below.truth->Now().focus_steps, outcome.native_bound->value);
  EXPECT_LT(outcome.native_bound->value, 4.0);
  EXPECT_NE(outcome.remark.find("other side"), std::string::npos);
}

TEST(Presets, AStopOfAnAxisWhoseTurnHasNotComeCancelsAndACommandForItSupersedes) {
  for (const bool stops : {true, false}) {
    RigOnSim bench(SceneWith(kZoom));
    ASSERT_TRUE(Move(bench, Axis::Zoom, To(Kind::FocalLength, 0.05)).reached);
    const auto preset = TakePreset(*bench.rig, "long");
    ASSERT_TRUE(preset) << preset.error().message;
    ASSERT_TRUE(Move(bench, Axis::Zoom, To(Kind::FocalLength, 0.025)).reached);
    std::optional<Result<RecallOutcome>> answer;
    RecallPreset(*bench.rig, *preset, [&](Result<RecallOutcome> outcome) { answer = std::move(outcome); });
    bench.Run(std::chrono::milliseconds(50));
    ASSERT_TRUE(bench.rig->GetStatus().axes[Axis::Zoom]->moving);
    stops ? bench.rig->Stop({Axis::Focus}, nullptr) : bench.rig->Move(Axis::Focus, To(Kind::Native, 50), nullptr);
    bench.RunUntil([&] { return answer.has_value(); }, std::chrono::seconds(20));
    ASSERT_TRUE(answer && !*answer);
    EXPECT_EQ(answer->error().code, stops ? Code::Cancelled : Code::Superseded) << answer->error().message;
    EXPECT_TRUE(answer->error().message.ends_with("; arrived: zoom; not arrived: iris, focus"))
        << answer->error().message;
  }
}

TEST(Presets, TheFileReadsBackAndIsChecked) {
  RigOnSim bench(SceneWith(kZoom));
  const auto one = TakePreset(*bench.rig, "one"), two = TakePreset(*bench.rig, "two.2");
  ASSERT_TRUE(one && two);
  const std::string text = PresetsText({*one, *two});
  const auto parsed = io::ParseToml(text, "p.toml");
  ASSERT_TRUE(parsed) << parsed.error().message;
  const auto read = ReadPresets(*parsed);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(PresetsText(*read), text);
  EXPECT_EQ(TakePreset(*bench.rig, "no \"quotes\"").error().code, Code::InvalidArgument);
  EXPECT_EQ(TakePreset(*bench.rig, "").error().code, Code::InvalidArgument);
  const auto twice = io::ParseToml(PresetsText({*one, *one}), "p.toml");
  EXPECT_NE(ReadPresets(*twice).error().message.find("another preset \"one\""), std::string::npos);
  bench.rig->Move(Axis::Focus, To(Kind::Native, 5000), nullptr);
  bench.Run(std::chrono::milliseconds(20));
  EXPECT_EQ(TakePreset(*bench.rig, "moving").error().code, Code::Busy);
}

}  // namespace
}  // namespace lensd::rig
