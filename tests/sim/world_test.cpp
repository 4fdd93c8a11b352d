// Lens, light and sensor together: what a frame shows is what the lens was during the exposure.
#include "sim/world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "io/toml.h"
#include "sim/driver.h"
#include "stage.h"

namespace lensd::sim {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(World, MovesFocusAndReportsIt) {
  Stage stage(SmallScene());
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{4000}).has_value());
  auto state = stage.lens().Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_TRUE(state->axes[Axis::Focus]->moving);
  // 4000 steps at 8000 a second, with 0.04 s to gain and lose speed: 0.54 s.
  stage.clock.Advance(milliseconds(539));
  EXPECT_TRUE(stage.lens().Read()->axes[Axis::Focus]->moving);
  stage.clock.Advance(milliseconds(2));
  state = stage.lens().Read();
  EXPECT_FALSE(state->axes[Axis::Focus]->moving);
  EXPECT_EQ(state->axes[Axis::Focus]->position, Native{4000});
  stage.clock.Advance(milliseconds(100));
  const TrueState truth = stage.world.truth->Now();
  EXPECT_NEAR(truth.focus_steps, 4000.0, 1e-6);
  EXPECT_NEAR(truth.extension_m, 1.6e-3 * 4000.0 / 8191.0, 1e-12);
}

TEST(World, ExposesOnTheFrameGrid) {
  Stage stage(SmallScene());
  EXPECT_EQ(stage.camera().Poll().error().code, Code::InvalidArgument);
  stage.clock.Advance(milliseconds(1));
  ASSERT_TRUE(stage.camera().Start().has_value());
  auto frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  EXPECT_FALSE(frame->has_value());
  const Duration period(std::llround(1e9 / 60.0));
  stage.clock.AdvanceTo(Instant(period + milliseconds(10)));
  frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_EQ((*frame)->exposure_start, Instant(period));
  EXPECT_EQ((*frame)->exposure_end, Instant(period + milliseconds(10)));
  EXPECT_EQ((*frame)->sequence, 0u);
  EXPECT_FALSE(stage.camera().Poll()->has_value());
  stage.clock.Advance(period * 3);
  EXPECT_EQ((*stage.camera().Poll())->sequence, 3u);
}

TEST(World, LightFollowsTheWorkingFNumber) {
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.clock.Advance(milliseconds(20));
  auto frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_NEAR(MeanLevel(**frame) / 65535.0, 0.45, 1e-4);
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{8191}).has_value());
  ASSERT_TRUE(stage.lens().StartMove(Axis::Iris, Native{99}).has_value());
  stage.clock.Advance(seconds(3));
  frame = stage.camera().Poll();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  const double working = 16.0 * (1.0 + 1.6 / 25.0);
  EXPECT_NEAR(MeanLevel(**frame) / 65535.0, 0.45 * 4.0 / (working * working), 1e-4);
}

TEST(World, APinholeIsSharpAndEvenlyLitAtAnyOpening) {
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  scene.lens.model = LensModel::Pinhole;
  scene.surfaces[0].paint = SinusoidPaint{16.0, 0.0};
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  ASSERT_TRUE(stage.lens().StartMove(Axis::Iris, Native{0}).has_value());
  stage.Wait(1000);
  const auto frame = *stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  const auto [low, high] = std::minmax_element(frame->samples->begin(), frame->samples->end());
  // Full contrast but for what a pixel averages over and its centre's distance from the crest.
  EXPECT_GT(*high / 65535.0, 0.9 * 0.98);
  EXPECT_LT(*low / 65535.0, 0.9 * 0.02);
  EXPECT_NEAR(MeanLevel(*frame) / 65535.0, 0.45, 1e-3);
}

TEST(World, AnApertureWithoutALensIsLitByItsAngle) {
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  scene.lens.model = LensModel::Aperture;
  Stage stage(scene, {.focus_start = Native{8191}});
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(20);
  const auto frame = *stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  // A/Z_s relative to 1/2.0, with A = 25 mm/2 and Z_s = 26.6 mm.
  const double angle = 2.0 * 12.5 / 26.6;
  EXPECT_NEAR(MeanLevel(*frame) / 65535.0, 0.45 * angle * angle, 1e-4);
}

TEST(World, KnowsTheTruthOfItsRegion) {
  Scene scene = SmallScene();
  scene.surfaces.push_back({PlaneShape{2.0, 0.0, 0.0}, {0.0, 0.0, 0.45, 1.0}, ConstantPaint{0.5}});
  scene.truth_region = {0.25, 0.0, 0.5, 1.0};
  const Stage stage(scene);
  const auto& subjects = stage.world.truth->subjects();
  ASSERT_EQ(subjects.size(), 2u);
  EXPECT_EQ(subjects[0].vergence_d, 1.0);
  EXPECT_EQ(subjects[1].vergence_d, 2.0);
  EXPECT_NEAR(subjects[0].share, 10.0 / 16.0, 1e-12);
}

TEST(World, RefusesAStartOutsideTheRange) {
  SteppedClock clock;
  const auto world = OpenWorld(std::make_shared<const Scene>(SmallScene()), clock, {.focus_start = Native{9000}});
  ASSERT_FALSE(world.has_value());
  EXPECT_EQ(world.error().code, Code::InvalidArgument);
}

TEST(World, SameSeedSameFramesWhoeverRendersThem) {
  Scene scene = SmallScene();
  scene.camera.full_well_e = 5000.0;
  scene.camera.read_noise_e = 2.0;
  scene.surfaces[0].paint = SinusoidPaint{8.0, 5.0};
  const auto shared = std::make_shared<const Scene>(scene);
  const auto pictures = *Pictures::Create(shared);
  const auto film = [&](std::uint64_t seed, std::shared_ptr<Pictures> from) {
    Stage stage(scene, {.seed = seed, .focus_start = Native{100}, .pictures = std::move(from)});
    std::vector<std::vector<std::uint16_t>> frames;
    EXPECT_TRUE(stage.camera().Start().has_value());
    for (int i = 0; i < 8; ++i) {
      EXPECT_TRUE(stage.lens().StartMove(Axis::Focus, Native{900.0 * i}).has_value());
      stage.Wait(47);
      if (auto frame = stage.camera().Poll(); frame && *frame) frames.push_back(*(*frame)->samples);
    }
    return frames;
  };
  const auto once = film(4, nullptr);
  ASSERT_EQ(once.size(), 8u);
  EXPECT_EQ(once, film(4, pictures));
  EXPECT_EQ(once, film(4, pictures));
  EXPECT_NE(once, film(5, pictures));
  EXPECT_NE(once[0], once[1]);
}

TEST(World, NoiseIsNewInEveryFrame) {
  Scene scene = SmallScene();
  scene.camera.full_well_e = 5000.0;
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(20);
  const auto first = *stage.camera().Poll();
  stage.Wait(20);
  const auto second = *stage.camera().Poll();
  ASSERT_TRUE(first && second);
  EXPECT_NE(*first->samples, *second->samples);
}

TEST(World, FlickerBrightensByItsMeanOverTheExposure) {
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  scene.camera.flicker = 0.4;
  scene.camera.exposure_ms = 3.0;
  scene.camera.frame_rate_hz = 110.0;  // so that frames meet the lamp at other times
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  double darkest = 1.0;
  double brightest = 0.0;
  for (int i = 0; i < 12; ++i) {
    stage.Wait(9);
    const auto frame = *stage.camera().Poll();
    if (!frame) continue;
    double lamp = 0.0;
    constexpr int kParts = 3000;
    for (int part = 0; part < kParts; ++part) {
      const double t =
          static_cast<double>(frame->exposure_start.time_since_epoch().count()) * 1e-9 + 3e-3 * (part + 0.5) / kParts;
      lamp += (1.0 + 0.4 * std::cos(2.0 * 3.14159265358979 * 100.0 * t)) / kParts;
    }
    const double level = MeanLevel(*frame) / 65535.0;
    EXPECT_NEAR(level, 0.45 * lamp, 1e-4);
    darkest = std::min(darkest, level);
    brightest = std::max(brightest, level);
  }
  EXPECT_GT(brightest - darkest, 0.2);
}

TEST(World, ExposureScalesLightAndTheFrameRateGivesWay) {
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  ASSERT_TRUE(stage.camera().SetExposure(milliseconds(20)).has_value());
  stage.Wait(100);
  const auto frame = *stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->exposure_end - frame->exposure_start, milliseconds(20));
  EXPECT_NEAR(MeanLevel(*frame) / 65535.0, 0.9, 1e-4);
  // 20 ms do not fit into 1/60 s, so every second cell of the grid starts a frame: 0, 33.3, 66.7 ms.
  EXPECT_EQ(frame->sequence, 2u);
  EXPECT_EQ(stage.camera().SetExposure(seconds(1000)).error().code, Code::OutOfRange);
}

TEST(World, AFrameShowsTheLensAsItWasDuringTheExposure) {
  // A point of light far out of focus at the start, sharp at the end of the move.
  Scene scene = SmallScene();
  scene.camera.bits = 16;
  scene.lights.push_back({0.5, 0.5, 1.0, 0.2});
  scene.surfaces[0].paint = ConstantPaint{0.0};
  scene.lens.settle_ms = 0.0;
  const double sharp = std::round(8191.0 * (0.025 * 0.025 / (1.0 - 0.025)) / 1.6e-3);
  const auto peak = [](const drivers::Frame& frame) {
    return *std::max_element(frame.samples->begin(), frame.samples->end());
  };
  Stage stage(scene);
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(15);
  // The exposure from 0 to 10 ms is over before the lens moves; it is fetched long after.
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{sharp}).has_value());
  stage.Wait(1);
  const auto before = *stage.camera().Poll();
  ASSERT_TRUE(before.has_value());
  EXPECT_LT(peak(*before), 100);
  stage.Wait(2000);
  const auto after = *stage.camera().Poll();
  ASSERT_TRUE(after.has_value());
  EXPECT_GT(peak(*after), 2000);
}

TEST(World, IrisBacklashActsOnTheApertureAlone) {
  Scene scene = SmallScene();
  scene.lens.iris_backlash_steps = 5.0;
  Stage stage(scene);
  const auto f_number_at = [](double place) { return 1.4 * std::pow(16.0 / 1.4, place / 99.0); };
  ASSERT_TRUE(stage.lens().StartMove(Axis::Iris, Native{60}).has_value());
  stage.Wait(1000);
  EXPECT_NEAR(stage.world.truth->Now().f_number, f_number_at(60), 1e-9);
  ASSERT_TRUE(stage.lens().StartMove(Axis::Iris, Native{40}).has_value());
  stage.Wait(1000);
  EXPECT_NEAR(stage.world.truth->Now().f_number, f_number_at(45), 1e-9);
  EXPECT_EQ(stage.FocusPlace(), 0.0);
}

TEST(World, WarmthMovesTheFocusBehindTheCountsBack) {
  Scene scene = SmallScene();
  scene.lens.temperature_c = 35.0;
  scene.lens.drift_um_per_c = 0.8;
  Stage stage(scene, {.focus_start = Native{1000}});
  EXPECT_NEAR(stage.world.truth->Now().extension_m, 1.6e-3 * 1000.0 / 8191.0 + 12e-6, 1e-12);
  EXPECT_EQ(stage.lens().Read()->temperature, Celsius{35.0});
  EXPECT_EQ(stage.FocusCount(), 1000.0);
}

TEST(World, BreathingChangesTheFocalLengthWithFocus) {
  Scene scene = SmallScene();
  scene.lens.breathing = 0.02;
  Stage stage(scene, {.focus_start = Native{8191}});
  const TrueState state = stage.world.truth->Now();
  EXPECT_NEAR(state.optics.focal_length_m, 0.0255, 1e-12);
  EXPECT_NEAR(state.optics.sensor_distance_m, 0.0255 + 1.6e-3, 1e-12);
  EXPECT_NEAR(state.optics.aperture_diameter_m, 0.0125, 1e-12);
  EXPECT_NEAR(state.optics.magnification, 1.02, 1e-12);
}

/// The same wave pattern, 2 % larger about the frame's middle where the lens is out all the way.
TEST(World, BreathingScalesThePicture) {
  Scene scene = SmallScene();
  scene.camera.width = 201;
  scene.camera.bits = 16;
  scene.surfaces[0].paint = SinusoidPaint{20.0, 0.0};
  scene.lens.min_f_number = scene.lens.max_f_number = scene.lens.initial_f_number = 1000.0;  // sharp everywhere
  scene.lens.breathing = 0.02;
  Stage stage(scene, {.focus_start = Native{8191}});
  ASSERT_TRUE(stage.camera().Start().has_value());
  stage.Wait(100);
  const auto frame = *stage.camera().Poll();
  ASSERT_TRUE(frame.has_value());
  const auto [low, high] = std::ranges::minmax_element(*frame->samples);
  for (int x = 0; x < 201; ++x) {
    const double seen = 100.5 + (x + 0.5 - 100.5) / 1.02;
    const double light = 0.5 + 0.5 * std::cos(2.0 * std::numbers::pi * seen / 20.0);
    const double level = (*frame->samples)[static_cast<std::size_t>(10 * 201 + x)];
    ASSERT_NEAR((level - *low) / (*high - *low), light, 0.004) << x;
  }
}

TEST(World, ZoomsInMillimetres) {
  Scene scene = SmallScene();
  scene.lens.min_focal_length_mm = 20.0;
  scene.lens.max_focal_length_mm = 60.0;
  Stage stage(scene);
  ASSERT_TRUE(stage.lens().capabilities().axes[Axis::Zoom].has_value());
  EXPECT_EQ(stage.lens().capabilities().axes[Axis::Zoom]->unit, drivers::NativeUnit::Millimetres);
  ASSERT_TRUE(stage.lens().StartMove(Axis::Zoom, Native{40.02}).has_value());
  stage.Wait(2000);
  EXPECT_NEAR(stage.world.truth->Now().optics.focal_length_m, 0.04004, 1e-9);  // places are 0.04 mm apart
  EXPECT_NEAR(stage.world.truth->Now().optics.magnification, 2.002, 1e-7);
}

TEST(World, HomesAndStops) {
  Stage stage(SmallScene(), {.focus_start = Native{5000}});
  ASSERT_TRUE(stage.lens().StartHome(Axis::Focus).has_value());
  stage.Wait(100);
  EXPECT_FALSE(stage.lens().Read()->axes[Axis::Focus]->homed);
  stage.Wait(900);
  EXPECT_TRUE(stage.lens().Read()->axes[Axis::Focus]->homed);
  EXPECT_EQ(stage.FocusCount(), 0.0);
  ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{8000}).has_value());
  stage.Wait(500);
  ASSERT_TRUE(stage.lens().Stop(Axis::Focus).has_value());
  stage.Wait(41);
  EXPECT_FALSE(stage.lens().Read()->axes[Axis::Focus]->moving);
  EXPECT_EQ(stage.FocusCount(), 4000.0);
}

TEST(World, ALensOfOneApertureHasNoIris) {
  Scene scene = SmallScene();
  scene.lens.min_f_number = scene.lens.max_f_number = scene.lens.initial_f_number = 4.0;
  Stage stage(scene);
  EXPECT_FALSE(stage.lens().capabilities().axes[Axis::Iris].has_value());
  EXPECT_EQ(stage.world.truth->Now().f_number, 4.0);
}

TEST(World, HalfADepthOfFieldIsTwoPixelsOfBlur) {
  Stage stage(SmallScene(), {.focus_start = Native{3282}});
  const TrueState state = stage.world.truth->Now();
  const CameraSettings camera = SmallScene().camera;
  const double half = HalfDepthOfFieldD(camera, state);
  const double here = SignedBlurPx(camera, state.optics, state.focal_plane_d);
  EXPECT_NEAR(here, 0.0, 1e-6);
  EXPECT_NEAR(SignedBlurPx(camera, state.optics, state.focal_plane_d - half), 2.0, 1e-6);
}

Settings DriverSettings(const std::string& text) {
  return *io::ParseToml(text, std::string(LENSD_SOURCE_DIR) + "/scenes/config.toml");
}

TEST(SimDriver, OpensEveryShippedScene) {
  SteppedClock clock;
  int scenes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(LENSD_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".toml") continue;
    ++scenes;
    const std::string name = entry.path().string();
    auto device = OpenSim(DriverSettings("scene = \"" + name + "\"\nseed = 3\n"), clock);
    ASSERT_TRUE(device.has_value()) << device.error().message;
    const bool has_lens = entry.path().stem() != "pinhole" && entry.path().stem() != "aperture";
    ASSERT_EQ(device->optics.has_value(), has_lens) << name;
    ASSERT_TRUE(device->camera->Start().has_value());
    clock.Advance(seconds(1));
    const auto frame = device->camera->Poll();
    ASSERT_TRUE(frame.has_value() && frame->has_value()) << name;
    EXPECT_GT(MeanLevel(**frame), 10.0) << name;
    EXPECT_LT(MeanLevel(**frame), 200.0) << name;
  }
  EXPECT_GE(scenes, 14);
}

TEST(SimDriver, ExplainsItsSettings) {
  SteppedClock clock;
  const auto missing = OpenSim(DriverSettings("seed = 1\n"), clock);
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, Code::BadData);
  const auto unknown = OpenSim(DriverSettings("scene = \"brick.toml\"\nspeed = 1\n"), clock);
  ASSERT_FALSE(unknown.has_value());
  EXPECT_NE(unknown.error().message.find("config.toml:2: unknown key \"speed\""), std::string::npos);
}

}  // namespace
}  // namespace lensd::sim
