// Apertures with straight blades, and pictures that grow as a lens breathes.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <tuple>

#include "render_scenes.h"
#include "sim/render/aperture_shape.h"
#include "sim/render/ray_tracer.h"

namespace lensd::sim {
namespace {

constexpr double kDiskArea = 0.25 * std::numbers::pi;

Scene WithBlades(Scene scene, int blades) {
  scene.lens.aperture_blades = blades;
  return scene;
}

TEST(ApertureShape, PolygonsHaveTheCirclesArea) {
  for (const int blades : {0, 3, 5, 6, 8, 11}) {
    const ApertureShape shape(blades);
    EXPECT_NEAR(shape.AreaIn(1.0, -1.0, -1.0, 1.0, 1.0), kDiskArea, 1e-14) << blades;
    EXPECT_NEAR(shape.AreaIn(-3.0, -3.0, -3.0, 3.0, 3.0), 9.0 * kDiskArea, 1e-13) << blades;
    EXPECT_EQ(shape.AreaIn(1.0, 0.9, -1.0, 1.0, 1.0), 0.0) << blades;
    EXPECT_NEAR(shape.AreaIn(1.0, -0.1, -0.1, 0.1, 0.1), 0.04, 1e-15) << blades;
  }
}

/// Points of the shape, counted in rectangles and averaged over plane waves, against the areas and the closed form.
TEST(ApertureShape, PointsAreasAndTransferAgree) {
  for (const int blades : {0, 3, 5, 6}) {
    const ApertureShape shape(blades);
    const std::vector<AperturePoint> points = SpreadOverAperture(200000, shape);
    const auto count = static_cast<double>(points.size());
    for (const auto& [x0, y0, x1, y1] : {std::tuple(-0.5, -0.3, 0.1, 0.4), std::tuple(0.2, 0.05, 0.7, 0.3)}) {
      double inside = 0.0;
      for (const AperturePoint& p : points) inside += p.x >= x0 && p.x < x1 && p.y >= y0 && p.y < y1 ? 1.0 : 0.0;
      EXPECT_NEAR(shape.AreaIn(1.0, x0, y0, x1, y1), kDiskArea * inside / count, 1e-4) << blades;
    }
    for (const auto& [kx, ky] : {std::pair(1e-5, 0.0), std::pair(3.0, 0.0), std::pair(-4.0, 9.0)}) {
      std::complex<double> mean = 0.0;
      for (const AperturePoint& p : points) mean += std::polar(1.0 / count, -(kx * p.x + ky * p.y));
      EXPECT_LT(std::abs(shape.Transfer(kx, ky) - mean), 2e-5) << blades << ' ' << kx;
    }
  }
}

TEST(Render, BladesAgreeWithRays) {
  Scene wall = EmptyScene(16, 12);
  wall.surfaces.push_back(Wall(1.0, Noise(30, 22, 2)));
  Scene waves = EmptyScene(16, 12);
  waves.surfaces.push_back(Wall(1.0, SinusoidPaint{9.0, 7.0}));
  Scene layers = wall;
  layers.surfaces.push_back(Wall(1.3, Noise(24, 20, 3), {0.4, 0.0, 0.3, 1.0}));
  Scene plane = EmptyScene(16, 12);
  plane.surfaces.push_back({PlaneShape{1.0, 0.002, 0.001}, {}, WhiteNoise(24, 20, 5)});
  std::get<TexturePaint>(plane.surfaces[0].paint).texture_px_per_image_px = 0.1;
  const std::tuple<Scene, int, Algorithm> cases[] = {{wall, 6, Algorithm::Wall},     {wall, 5, Algorithm::March},
                                                     {waves, 6, Algorithm::Fourier}, {waves, 5, Algorithm::Fourier},
                                                     {layers, 8, Algorithm::Hybrid}, {plane, 6, Algorithm::Gather}};
  for (const auto& [plain, blades, expected] : cases) {
    const Scene scene = WithBlades(plain, blades);
    for (const double diameter : {-9.3, 3.0, 14.0}) {
      const OpticalState state = Blurred(scene, diameter, 1.0);
      const auto renderer = Renderer::Create(scene);
      const auto rays = renderer->Render(state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 15000});
      const auto quick = renderer->Render(state);
      ASSERT_TRUE(rays && quick);
      EXPECT_EQ(quick->algorithm, expected) << blades << ' ' << diameter;
      EXPECT_LT(Percentile(rays->image, quick->image, 0.999), quick->error_bound + rays->error_bound + kLeftByFits)
          << blades << ' ' << diameter;
      EXPECT_GT(LargestDifference(Render(plain, state), quick->image), 5e-5) << "a polygon is no circle";
    }
  }
}

/// Five blades do not look the same upside down: in front of the focal plane the blur stands on its head.
TEST(Render, BladesTurnOverAtTheFocalPlane) {
  Scene scene = WithBlades(EmptyScene(16, 12), 5);
  scene.surfaces.push_back(Wall(1.0, Noise(16, 12, 5)));
  const auto renderer = Renderer::Create(scene);
  for (const double diameter : {7.3, -7.3}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    const auto reverse = renderer->Render(state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 30000});
    ASSERT_TRUE(reverse);
    const LightImage forward = Render(scene, state, {.algorithm = Algorithm::Splat});
    EXPECT_LT(LargestDifference(reverse->image, forward), 0.005) << "beside what shares of area leave";
    const LightImage other = Render(scene, Blurred(scene, -diameter, 1.0), {.algorithm = Algorithm::Splat});
    EXPECT_GT(LargestDifference(reverse->image, other), 2e-2);
  }
}

TEST(Render, BladesShapePointsOfLight) {
  Scene scene = WithBlades(EmptyScene(60, 60), 6);
  scene.lights.push_back({0.5, 0.5, 1.0, 900.0});
  const LightImage image = Render(scene, Blurred(scene, 30.0, 1.0));
  const ApertureShape hexagon(6);
  double sum = 0.0;
  for (const float light : image.light) sum += static_cast<double>(light);
  EXPECT_NEAR(sum, 900.0, 1e-3);
  const auto at = [&](int x, int y) { return image.light[static_cast<std::size_t>(y * 60 + x)]; };
  EXPECT_GT(at(30 + 15, 30), 0.0f);  // a corner reaches 16.5 px, a side's middle 14.3 px
  EXPECT_EQ(at(30, 30 + 15), 0.0f);
}

OpticalState Magnified(OpticalState state, double magnification) {
  state.magnification = magnification;
  return state;
}

TEST(Render, MagnifiedPicturesAgreeWithRays) {
  Scene wall = EmptyScene(20, 16);
  wall.surfaces.push_back(Wall(1.0, Noise(44, 33, 2)));
  Scene plane = EmptyScene(20, 16);
  plane.surfaces.push_back({PlaneShape{1.0, 0.02, 0.01}, {}, Noise(20, 16, 6)});
  Scene layers = wall;
  layers.surfaces.push_back(Wall(1.3, Noise(20, 16, 3), {0.4, 0.0, 0.3, 1.0}));
  Scene depth = EmptyScene(20, 16);
  auto map = std::make_shared<DepthMap>(DepthMap{20, 16, {}});
  for (int i = 0; i < 20 * 16; ++i) map->depth_m.push_back(i % 20 < 8 ? 0.9f : 1.0f);
  TexturePaint stretched = Noise(20, 16, 7);
  stretched.stretched = true;
  depth.surfaces.push_back({DepthMapShape{map}, {}, stretched});
  depth.lights.push_back({0.7, 0.6, 0.7, 30.0});
  Scene waves = EmptyScene(20, 16);
  waves.surfaces.push_back(Wall(1.0, SinusoidPaint{9.0, 7.0}));
  const std::pair<Scene, Algorithm> cases[] = {{wall, Algorithm::Wall},
                                               {plane, Algorithm::Plane},
                                               {layers, Algorithm::Hybrid},
                                               {depth, Algorithm::March},
                                               {waves, Algorithm::Fourier}};
  for (const auto& [scene, expected] : cases) {
    for (const double magnification : {0.97, 1.02, 1.4}) {
      const OpticalState state = Magnified(Blurred(scene, 5.0, 1.0), magnification);
      const auto renderer = Renderer::Create(scene);
      const auto rays = renderer->Render(state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 6000});
      const auto quick = renderer->Render(state);
      ASSERT_TRUE(rays && quick);
      EXPECT_EQ(quick->algorithm, expected) << magnification;
      EXPECT_LT(Percentile(rays->image, quick->image, 0.999), quick->error_bound + rays->error_bound + kLeftByFits)
          << NameOf(expected) << magnification;
      const LightImage small = Render(scene, Blurred(scene, 5.0, 1.0));
      EXPECT_GT(LargestDifference(small, quick->image), 4e-3) << "nothing grew";
    }
  }
}

/// What stands at x, measured from the frame's middle, goes to m x, and keeps its contrast on the way.
TEST(Render, MagnificationMovesWhatIsSeen) {
  constexpr int kWidth = 200, kHeight = 12;
  auto waves = std::make_shared<Texture>(Texture{kWidth, kHeight, {}});
  const auto wave = [](double x) { return 0.5 + 0.4 * std::cos(2.0 * std::numbers::pi * x / 5.0); };
  for (int i = 0; i < kWidth * kHeight; ++i) waves->light.push_back(static_cast<float>(wave(i % kWidth + 0.5)));
  Scene scene = EmptyScene(kWidth, kHeight);
  scene.surfaces.push_back(Wall(1.0, TexturePaint{waves, 1.0, false}));
  for (const double magnification : {0.99, 1.005, 1.1}) {
    const LightImage image = Render(scene, Magnified(Blurred(scene, 0.0, 1.0), magnification));
    for (int x = 10; x < kWidth - 10; ++x) {
      const double seen = 0.5 * kWidth + (x + 0.5 - 0.5 * kWidth) / magnification;
      ASSERT_NEAR(static_cast<double>(image.light[static_cast<std::size_t>(6 * kWidth + x)]), wave(seen), 0.012)
          << magnification << ' ' << x;
    }
  }
}

TEST(Render, RefusesWhatIsNoApertureOrMagnification) {
  Scene scene = EmptyScene(8, 8);
  scene.surfaces.push_back(Wall(1.0, ConstantPaint{0.5}));
  EXPECT_FALSE(Renderer::Create(WithBlades(scene, 2)));
  const auto renderer = Renderer::Create(scene);
  for (const double magnification : {0.0, -1.0, std::nan("")}) {
    EXPECT_FALSE(renderer->Render(Magnified(Blurred(scene, 0.0, 1.0), magnification)));
  }
}

}  // namespace
}  // namespace lensd::sim
