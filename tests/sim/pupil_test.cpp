// Lenses that are not perfect: rays against closed forms of geometry, and fast renderers against rays.
#include "sim/render/pupil.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "render_scenes.h"

namespace lensd::sim {
namespace {

constexpr int kSide = 96;
constexpr double kMiddle = 0.5 * kSide;

/// Round spots so wide that no pixel grid hides anything of them, on black, each of light 1 in its middle.
TexturePaint Spots(const std::vector<std::pair<double, double>>& places, int side = kSide) {
  constexpr double kSpread_px = 1.5;
  auto texture =
      std::make_shared<Texture>(Texture{side, side, std::vector<float>(static_cast<std::size_t>(side * side))});
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (const auto& [cx, cy] : places) {
        const double away = std::hypot(x + 0.5 - cx, y + 0.5 - cy) / kSpread_px;
        texture->light[static_cast<std::size_t>(y * side + x)] += static_cast<float>(std::exp(-0.5 * away * away));
      }
    }
  }
  return {texture, 1.0, false};
}

/// A point of light at 1 m in the middle of a dark frame.
Scene PointScene(int side = kSide) {
  Scene scene = EmptyScene(side, side);
  scene.lens.min_f_number = 2.5;  // which Blurred() opens to
  scene.lights.push_back({0.5, 0.5, 1.0, 1.0});
  return scene;
}

double SumOf(const LightImage& image, const std::function<bool(double, double)>& where) {
  double sum = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (where(x + 0.5, y + 0.5))
        sum += static_cast<double>(image.light[static_cast<std::size_t>(y * image.width + x)]);
    }
  }
  return sum;
}

double Within(const LightImage& image, double radius) {
  return SumOf(image, [&](double x, double y) { return std::hypot(x - kMiddle, y - kMiddle) < radius; });
}

double Everything(const LightImage& image) {
  return SumOf(image, [](double, double) { return true; });
}

/// Of the light of `b`, how much of `a` is elsewhere.
double Elsewhere(const LightImage& a, const LightImage& b) {
  double apart = 0.0;
  for (std::size_t i = 0; i < a.light.size(); ++i)
    apart += std::abs(static_cast<double>(a.light[i]) - static_cast<double>(b.light[i]));
  return apart / Everything(b);
}

/// px that a rim ray lands off by W040 of 1 um at f/2.5 focused at 1 m, were focus the paraxial one: 8 N (1 + m) W040.
double RimPx(const OpticalState& state) {
  return 8.0 * state.sensor_distance_m / state.aperture_diameter_m / 5.0;
}

TEST(PupilRays, SphericalAberrationIsABrightRimBeforeFocusAndABrightCoreBehind) {
  Scene scene = PointScene();
  scene.lens.spherical_um = 0.4;
  for (const double blur : {-30.0, 30.0}) {  // the light nearer than focus, and farther
    const OpticalState state = Blurred(scene, blur, 1.0);
    const LightImage image = Render(scene, state);
    EXPECT_NEAR(Everything(image), 1.0, 1e-3);
    // A ray through rho lands at r = |rho (-blur/2) - rim (rho^3 - 2/3 rho)|; rays are even in rho^2.
    const double rim = RimPx(state) * scene.lens.spherical_um;
    const auto radius_of = [&](double rho) {
      return std::abs(-0.5 * blur * rho - rim * rho * (rho * rho - 2.0 / 3.0));
    };
    for (const double rho : {0.5, 0.9}) {
      EXPECT_NEAR(Within(image, radius_of(rho)), rho * rho, 0.02) << blur << " " << rho;
    }
    const double inner = Within(image, 5.0) / 25.0;
    const double outer = (Within(image, radius_of(0.98)) - Within(image, radius_of(0.8))) /
                         (std::pow(radius_of(0.98), 2) - std::pow(radius_of(0.8), 2));
    EXPECT_GT(blur < 0.0 ? outer : inner, 1.3 * (blur < 0.0 ? inner : outer));
  }
}

TEST(PupilRays, FocusIsWhereTheSpotsMeanSquareIsSmallest) {
  Scene scene = PointScene();
  scene.lens.spherical_um = 1.0;
  const auto mean_square = [&](double blur) {
    const LightImage image = Render(scene, Blurred(scene, blur, 1.0));
    double sum = 0.0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        sum += (std::pow(x + 0.5 - kMiddle, 2) + std::pow(y + 0.5 - kMiddle, 2)) *
               static_cast<double>(image.light[static_cast<std::size_t>(y * kSide + x)]);
      }
    }
    return sum;
  };
  EXPECT_LT(mean_square(0.0), mean_square(0.8));
  EXPECT_LT(mean_square(0.0), mean_square(-0.8));
  EXPECT_NEAR(mean_square(0.8), mean_square(-0.8), 0.03);
}

TEST(PupilRays, StoppingDownCuresSphericalAberrationWithTheThirdPower) {
  Scene scene = EmptyScene(64, 64);
  scene.lens.min_f_number = 2.5;
  scene.lens.spherical_um = 1.0;
  scene.lens.coma_um = 1.0;
  OpticalState state = Blurred(scene, 0.0, 1.0);
  const Pupil open(scene.lens, scene.camera, state);
  state.aperture_diameter_m *= 0.5;
  const Pupil stopped(scene.lens, scene.camera, state);
  const AperturePoint rim{0.5, 0.0};
  EXPECT_NEAR(open.LandsOff(rim, {}).x, -RimPx(Blurred(scene, 0.0, 1.0)) / 3.0, 1e-9);
  EXPECT_NEAR(stopped.LandsOff(rim, {}).x, open.LandsOff(rim, {}).x / 8.0, 1e-12);
  const double coma = open.LandsOff(rim, {1.0, 0.0}).x - open.LandsOff(rim, {}).x;
  EXPECT_NEAR(stopped.LandsOff(rim, {1.0, 0.0}).x - stopped.LandsOff(rim, {}).x, coma / 4.0, 1e-12);
}

TEST(PupilRays, ComaGrowsWithTheFieldAndKeepsTheSpotsMiddle) {
  Scene scene = PointScene();
  scene.lens.coma_um = 6.0;
  const auto spot = [&](double x) {
    scene.lights = {{x, 0.5, 1.0, 1.0}};
    const LightImage image = Render(scene, Blurred(scene, 0.0, 1.0));
    double mean = 0.0, third = 0.0;
    for (int i = 0; i < kSide * kSide; ++i)
      mean += (i % kSide + 0.5) * static_cast<double>(image.light[static_cast<std::size_t>(i)]);
    for (int i = 0; i < kSide * kSide; ++i)
      third += std::pow(i % kSide + 0.5 - mean, 3) * static_cast<double>(image.light[static_cast<std::size_t>(i)]);
    return std::pair(mean - x * kSide, third);
  };
  const auto [middle_off, middle_skew] = spot(0.5);
  const auto [right_off, right_skew] = spot(0.75);
  const auto [left_off, left_skew] = spot(0.25);
  for (const double off : {middle_off, right_off, left_off}) EXPECT_NEAR(off, 0.0, 0.02);
  EXPECT_NEAR(middle_skew, 0.0, 0.05);
  EXPECT_GT(std::abs(right_skew), 1.0);
  EXPECT_NEAR(left_skew, -right_skew, 0.02 * std::abs(right_skew));
}

TEST(PupilRays, AnObstructionAndACatsEyeTakeTheirShareOfTheLight) {
  Scene scene = PointScene();
  scene.lens.obstruction = 0.4;
  const OpticalState state = Blurred(scene, 30.0, 1.0);
  const LightImage ring = Render(scene, state);
  EXPECT_NEAR(Everything(ring), 1.0 - 0.16, 2e-3);
  EXPECT_LT(Within(ring, 0.4 * 15.0 - 2.0), 1e-6);
  scene.lens.obstruction = 0.0;
  scene.lens.cats_eye = 0.6;
  EXPECT_NEAR(Everything(Render(scene, state)), 1.0, 1e-3);
  scene.lights = {{0.75, 0.5, 1.0, 1.0}};
  const double off = 0.6 * 0.25 * kSide / (kMiddle * std::sqrt(2.0));  // in diameters
  const double lens_shape = 2.0 / M_PI * (std::acos(off) - off * std::sqrt(1.0 - off * off));
  EXPECT_NEAR(Everything(Render(scene, state)), lens_shape, 3e-3);
}

TEST(PupilRays, FieldCurvatureAndTiltMoveFocusOverTheFrame) {
  Scene scene = PointScene();
  scene.lens.field_curvature_um = 40.0;
  scene.lens.sensor_tilt_um = {20.0, 0.0};
  const Pupil pupil(scene.lens, scene.camera, Blurred(scene, 0.0, 1.0));
  OpticalState state = Blurred(scene, 0.0, 1.0);
  const double f = 0.5;  // half way to the right corner's distance
  // What the sensor has to be moved by so that a subject at 1 m, in focus in the middle, is in focus there.
  const double off_m = 1e-6 * (40.0 * f * f + 20.0 * f);
  state.sensor_distance_m += off_m;
  const BlurLine line = pupil.LineAt(BlurLineOf(scene.camera, state), {f, 0.0});
  EXPECT_NEAR(line.At(1.0), 0.0, 0.02);
  EXPECT_NEAR(FocusOffM(scene.lens, {f, 0.0}), off_m, 1e-12);
}

struct Flawed {
  const char* name;
  std::function<void(LensSettings&)> spoil;
};

const std::vector<Flawed>& FlawedLenses() {
  static const std::vector<Flawed> kLenses{
      {"obstruction", [](LensSettings& lens) { lens.obstruction = 0.4; }},
      {"spherical", [](LensSettings& lens) { lens.spherical_um = 0.8; }},
      {"overcorrected, hexagonal", [](LensSettings& lens) { lens.spherical_um = -0.8, lens.aperture_blades = 6; }},
      {"coma", [](LensSettings& lens) { lens.coma_um = 0.6; }},
      {"cat's eye", [](LensSettings& lens) { lens.cats_eye = 0.2; }},
      {"curved and tilted field",
       [](LensSettings& lens) { lens.field_curvature_um = 6.0, lens.sensor_tilt_um = {2.0, -2.0}; }},
      {"everything",
       [](LensSettings& lens) {
         lens.obstruction = 0.3, lens.spherical_um = 0.5, lens.coma_um = 0.3, lens.cats_eye = 0.1;
         lens.field_curvature_um = 3.0;
       }},
  };
  return kLenses;
}

/// A part of the frame away from its middle, by two renderers.
constexpr PixelRect kPart{56, 16, 24, 24};

Rendered PartOf(const Scene& scene, const OpticalState& state, RenderOptions options) {
  options.region = kPart;
  auto rendered = Renderer::Create(scene)->Render(state, options);
  EXPECT_TRUE(rendered);
  return *std::move(rendered);
}

/// Light of spots, which shows every part of the kernel, and of a picture of everything.
TEST(PupilRenderer, AgreesWithAberratedRaysToAHundredthOfTheEnergy) {
  for (const Flawed& flawed : FlawedLenses()) {
    for (const double blur : {-10.0, 3.0}) {
      SCOPED_TRACE(testing::Message() << flawed.name << ", blur " << blur);
      Scene scene = EmptyScene(kSide, kSide);
      scene.lens.min_f_number = 2.5;
      flawed.spoil(scene.lens);
      const OpticalState state = Blurred(scene, blur, 1.0);
      scene.surfaces = {Wall(1.0, Spots({{64.0, 27.0}, {74.5, 31.0}}))};
      const Rendered fast = PartOf(scene, state, {.tolerance = 2.0 / 255.0});
      EXPECT_EQ(fast.algorithm, Algorithm::Pupil);
      const Rendered truth = PartOf(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 2000});
      EXPECT_LT(Elsewhere(fast.image, truth.image), 0.01);
      scene.surfaces = {Wall(1.0, Noise(kSide, kSide, 5))};
      const Rendered lively = PartOf(scene, state, {.algorithm = Algorithm::Pupil});
      const Rendered rays = PartOf(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 2000});
      EXPECT_LT(Percentile(lively.image, rays.image, 0.999), lively.error_bound + kLeftByFits + rays.error_bound);
    }
  }
}

TEST(PupilRenderer, OcclusionIsSeenThroughTheSamePupil) {
  for (const Flawed& flawed : FlawedLenses()) {
    SCOPED_TRACE(flawed.name);
    Scene scene = TwoLayers(0.3, 11);
    scene.lens.min_f_number = 2.5;
    flawed.spoil(scene.lens);
    const OpticalState state = Blurred(scene, 12.0, 0.8);
    const auto renderer = Renderer::Create(scene);
    const PixelRect part{20, 10, 20, 12};  // across the strip's edge
    const auto chosen = renderer->Render(state, {.tolerance = 2.0 / 255.0, .region = part, .rays_per_pixel = 4096});
    const auto truth = renderer->Render(state, {.region = part, .algorithm = Algorithm::Rays, .rays_per_pixel = 4000});
    ASSERT_TRUE(chosen && truth);
    EXPECT_TRUE(chosen->algorithm == Algorithm::March || chosen->algorithm == Algorithm::Rays);
    EXPECT_LT(Elsewhere(chosen->image, truth->image), 0.01);
    EXPECT_FALSE(renderer->Render(state, {.algorithm = Algorithm::Layers}));
    EXPECT_FALSE(renderer->Render(state, {.algorithm = Algorithm::Gather}));
  }
}

TEST(PupilRenderer, APerfectLensIsNotItsBusiness) {
  Scene scene = EmptyScene(32, 32);
  scene.surfaces = {Wall(1.0, Noise(32, 32, 5))};
  const auto renderer = Renderer::Create(scene);
  const OpticalState state = Blurred(scene, 8.0, 1.0);
  EXPECT_FALSE(renderer->Render(state, {.algorithm = Algorithm::Pupil}));
  EXPECT_EQ(renderer->Render(state)->algorithm, Algorithm::Wall);
}

}  // namespace
}  // namespace lensd::sim
