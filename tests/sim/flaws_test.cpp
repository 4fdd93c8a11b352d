// What a sensor keeps wrong in every frame, and what a camera makes of its samples.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/camera/finish.h"
#include "sim/camera/sensor_map.h"
#include "stage.h"

namespace lensd::sim {
namespace {

using Values = std::vector<std::uint16_t>;

Scene WhiteScene() {
  Scene scene = SmallScene();
  scene.camera.width = 160;
  scene.camera.height = 120;
  scene.camera.bits = 16;
  scene.lens.model = LensModel::Pinhole;
  return scene;
}

Values NextValues(Stage& stage) {
  stage.Wait(40);
  const auto frame = stage.camera().Poll();
  EXPECT_TRUE(frame && *frame);
  return *(*frame)->samples;
}

Values ValuesOf(const Scene& scene, std::uint64_t seed = 1) {
  Stage stage(scene, {.seed = seed});
  EXPECT_TRUE(stage.camera().Start());
  return NextValues(stage);
}

double LevelAt(const Values& samples, int x, int y) {
  return samples[static_cast<std::size_t>(160 * y + x)] / 65535.0;
}

double MeanOf(const Values& samples) {
  double sum = 0.0;
  for (const std::uint16_t sample : samples) sum += sample / 65535.0;
  return sum / static_cast<double>(samples.size());
}

double SpreadOf(const Values& samples) {
  const double mean = MeanOf(samples);
  double squares = 0.0;
  for (const std::uint16_t sample : samples) squares += std::pow(sample / 65535.0 - mean, 2);
  return std::sqrt(squares / static_cast<double>(samples.size()));
}

constexpr double kWallLevel = 0.45;  // 0.9 of full scale is white, the wall half that

TEST(Flaws, CornersLoseWhatTheSceneSaysByTheFourthPowerOfTheCosine) {
  Scene scene = WhiteScene();
  scene.lens.vignetting = 0.4;
  const Values frame = ValuesOf(scene);
  EXPECT_NEAR(LevelAt(frame, 80, 60), kWallLevel, 1e-3);
  const double corner = std::acos(std::pow(0.6, 0.25));  // the angle whose cosine's fourth power is 0.6
  for (const auto& [x, y] : {std::pair{0, 0}, {159, 119}, {159, 60}, {40, 30}}) {
    const double out = std::hypot(x + 0.5 - 80.0, y + 0.5 - 60.0) / 100.0;
    EXPECT_NEAR(LevelAt(frame, x, y), kWallLevel * std::pow(std::cos(std::atan(out * std::tan(corner))), 4), 1e-4) << x;
  }
}

TEST(Flaws, DirtStaysInPlaceAndDarkens) {
  Scene scene = WhiteScene();
  scene.camera.flaws.dirt = 12;
  scene.camera.flaws.dirt_loss = 0.4;
  scene.camera.full_well_e = 1e6;
  const Values first = ValuesOf(scene, 1), second = ValuesOf(scene, 2);
  const auto darkest = std::ranges::min_element(first) - first.begin();
  EXPECT_LT(first[static_cast<std::size_t>(darkest)] / 65535.0, 0.85 * kWallLevel);
  EXPECT_GT(first[static_cast<std::size_t>(darkest)] / 65535.0, 0.55 * kWallLevel);
  EXPECT_NEAR(second[static_cast<std::size_t>(darkest)], first[static_cast<std::size_t>(darkest)], 400.0);
  scene.camera.flaws.seed = 2;
  const Values elsewhere = ValuesOf(scene, 1);
  EXPECT_NE(std::ranges::min_element(elsewhere) - elsewhere.begin(), darkest);
  const auto shaded =
      std::ranges::count_if(first, [](std::uint16_t sample) { return sample / 65535.0 < 0.95 * kWallLevel; });
  EXPECT_GT(shaded, 100);  // twelve specks of 4 to 12 px, some over another or the border
  EXPECT_LT(shaded, 1800);
}

TEST(Flaws, GainsOfPixelsSpreadAndAreTheSameInEveryFrame) {
  Scene scene = WhiteScene();
  scene.camera.flaws.prnu = 0.02;
  const Values frame = ValuesOf(scene, 1);
  EXPECT_NEAR(MeanOf(frame), kWallLevel, 1e-3);
  EXPECT_NEAR(SpreadOf(frame) / kWallLevel, 0.02, 0.0005);
  EXPECT_EQ(frame, ValuesOf(scene, 2));
}

TEST(Flaws, HotPixelsGatherDarkCurrentWithTheExposureAndNotWithTheLight) {
  Scene scene = WhiteScene();
  scene.surfaces[0].paint = ConstantPaint{0.0};
  scene.camera.flaws.hot_pixels = 0.01;
  Stage stage(scene, {});
  ASSERT_TRUE(stage.camera().Start());
  const Values frame = NextValues(stage);
  const auto hot = std::ranges::count_if(frame, [](std::uint16_t sample) { return sample > 6000; });
  EXPECT_EQ(hot, std::ranges::count_if(frame, [](std::uint16_t sample) { return sample > 0; }));
  EXPECT_NEAR(static_cast<double>(hot), 192.0, 4.5 * std::sqrt(192.0));
  ASSERT_TRUE(stage.camera().SetExposure(std::chrono::milliseconds(5)));  // half of the scene's
  stage.Wait(200);
  const Values half = NextValues(stage);
  for (std::size_t i = 0; i < frame.size(); ++i) EXPECT_NEAR(half[i], 0.5 * frame[i], 1.0) << i;
}

TEST(Flaws, AVeilTakesContrastAndNoLight) {
  Scene scene = WhiteScene();
  scene.surfaces[0].paint = GradientPaint{0.0, 1.0};
  const Values clear = ValuesOf(scene);
  scene.camera.veil = 0.25;
  const Values veiled = ValuesOf(scene);
  EXPECT_NEAR(MeanOf(veiled), MeanOf(clear), 1e-4);
  EXPECT_NEAR(SpreadOf(veiled), 0.75 * SpreadOf(clear), 1e-4);
}

TEST(Flaws, ColouredSensorsShareTheDirtAndNotThePixels) {
  CameraSettings camera;
  camera.width = camera.height = 64;
  camera.flaws.hot_pixels = 0.01;
  std::vector<float> red(64 * 64), green(64 * 64);
  SensorMap(camera, 0.0, Channel::Red).Apply(red, 1.0f);
  SensorMap(camera, 0.0, Channel::Green).Apply(green, 1.0f);
  EXPECT_NE(red, green);
  camera.flaws.hot_pixels = 0.0;
  camera.flaws.dirt = 5;
  red.assign(red.size(), 1.0f);
  green = red;
  SensorMap(camera, 0.0, Channel::Red).Apply(red, 1.0f);
  SensorMap(camera, 0.0, Channel::Green).Apply(green, 1.0f);
  EXPECT_EQ(red, green);
}

CameraSettings SmallCamera(int width, int height) {
  CameraSettings camera;
  camera.width = width;
  camera.height = height;
  return camera;
}

TEST(Flaws, AGreyCameraFocusesWhereItsColoursMeanIs) {
  Scene scene = WhiteScene();
  scene.lens.model = LensModel::Thin;
  const double green_d = Stage(scene).world.truth->Now().focal_plane_d;
  scene.lens.colour_focus_um = {20.0, 50.0};
  const TrueState state = Stage(scene).world.truth->Now();
  const double mean_m = 1e-6 * (0.2126 * 20.0 + 0.0722 * 50.0);
  const double f = state.optics.focal_length_m;
  EXPECT_NEAR(state.focal_plane_d - green_d, -mean_m / (f * f), 0.01 * mean_m / (f * f));
}

TEST(Flaws, AxialColourBlursEachChannelByItsOwnFocus) {
  Scene scene = WhiteScene();
  scene.lens.model = LensModel::Thin;
  scene.surfaces[0].shape = PlaneShape{0.0, 0.0, 0.0};  // in focus for green at count 0
  scene.surfaces[0].paint = SinusoidPaint{12.0, 0.0};
  const double sharp = SpreadOf(ValuesOf(scene));
  scene.lens.colour_focus_um = {80.0, 80.0};
  const double apart = SpreadOf(ValuesOf(scene));
  // Red and blue are 80 um at f/2 out of focus, 11.6 px: what a disk leaves of a period of 12 px is 2 J1(x)/x.
  const double x = M_PI * (80.0 / 2.0 / 3.45) / 12.0;
  const double left = 0.7152 + (1.0 - 0.7152) * 2.0 * std::cyl_bessel_j(1.0, x) / x;
  EXPECT_NEAR(apart / sharp, left, 0.01);
}

TEST(Flaws, APictureGrowsWithExtensionUnlessTheLensIsTelecentric) {
  Scene scene = WhiteScene();
  scene.lens.model = LensModel::Thin;
  EXPECT_EQ(Stage(scene, {.focus_start = Native{8191}}).world.truth->Now().optics.magnification, 1.0);
  scene.lens.telecentric = false;
  const TrueState state = Stage(scene, {.focus_start = Native{8191}}).world.truth->Now();
  EXPECT_NEAR(state.optics.magnification, 1.0 + 1.6 / 25.0, 1e-9);
}

TEST(Finish, ToneIsAnSCurve) {
  CameraSettings camera = SmallCamera(5, 1);
  camera.finish.tone = 1.0;
  const Values made = Finished(camera, {0, 16384, 32768, 49151, 65535});
  EXPECT_EQ(made, (Values{0, 40, 128, 215, 255}));  // 255 (3 x^2 - 2 x^3) at quarters
}

TEST(Finish, SharpeningOvershootsEdgesAndLeavesFlatPartsAlone) {
  CameraSettings camera = SmallCamera(8, 3);
  camera.finish.sharpening = 1.0;
  Values step(24);
  for (std::size_t i = 0; i < step.size(); ++i) step[i] = i % 8 < 4 ? 20046 : 40092;
  const Values made = Finished(camera, step);
  // A quarter of the step of 78 leaks into the mean on either side.
  for (std::size_t row = 0; row < 24; row += 8) {
    EXPECT_EQ(made[row], 78);
    EXPECT_NEAR(made[row + 3], 58.5, 1.0);
    EXPECT_NEAR(made[row + 4], 175.5, 1.0);
    EXPECT_EQ(made[row + 7], 156);
  }
}

/// Encoded and decoded by libjpeg-turbo.
Values ByTurboJpeg(const Values& samples, int width, int height, int quality) {
  std::vector<unsigned char> bytes(samples.begin(), samples.end());
  unsigned char* file = nullptr;
  unsigned long size = 0;
  const tjhandle encoder = tjInitCompress(), decoder = tjInitDecompress();
  EXPECT_EQ(tjCompress2(encoder, bytes.data(), width, 0, height, TJPF_GRAY, &file, &size, TJSAMP_GRAY, quality,
                        TJFLAG_ACCURATEDCT),
            0);
  EXPECT_EQ(tjDecompress2(decoder, file, size, bytes.data(), width, 0, height, TJPF_GRAY, TJFLAG_ACCURATEDCT), 0);
  tjFree(file);
  tjDestroy(encoder);
  tjDestroy(decoder);
  return {bytes.begin(), bytes.end()};
}

TEST(Finish, JpegLosesWhatAnEncoderLoses) {
  constexpr int kWidth = 67, kHeight = 45;  // no multiples of the blocks
  Values picture;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double light = 120.0 + 60.0 * std::sin(0.9 * x + 0.01 * y * y) + 40.0 * std::cos(0.5 * y) + (x * y) % 13;
      picture.push_back(static_cast<std::uint16_t>(std::clamp(light, 0.0, 255.0)));
    }
  }
  for (const int quality : {10, 20, 50, 75}) {
    const Values ours = ThroughJpeg(kWidth, kHeight, picture, quality);
    const Values theirs = ByTurboJpeg(picture, kWidth, kHeight, quality);
    double lost = 0.0, apart = 0.0;
    for (std::size_t i = 0; i < picture.size(); ++i) {
      lost += std::pow(theirs[i] - picture[i], 2);
      apart += std::pow(theirs[i] - ours[i], 2);
    }
    EXPECT_GT(lost, 0.3 * static_cast<double>(picture.size())) << quality;
    EXPECT_LT(apart, 0.03 * lost) << quality;  // ties that its integers round the other way
  }
}

TEST(Finish, ComesAfterTheSensorsNoise) {
  Scene scene = WhiteScene();
  scene.camera.bits = 8;
  scene.camera.full_well_e = 2000.0;
  const double plain = SpreadOf(ValuesOf(scene));
  scene.camera.finish.sharpening = 1.0;
  const double sharpened = SpreadOf(ValuesOf(scene));
  // The weights are 2 - 1/4 in the middle, -1/8 four times and -1/16 four times.
  EXPECT_NEAR(sharpened / plain, std::sqrt(1.75 * 1.75 + 4.0 / 64.0 + 4.0 / 256.0), 0.02);
  scene.camera.finish = {.tone = 0.0, .sharpening = 0.0, .jpeg_quality = 30};
  EXPECT_LT(SpreadOf(ValuesOf(scene)), 0.8 * plain);
}

}  // namespace
}  // namespace lensd::sim
