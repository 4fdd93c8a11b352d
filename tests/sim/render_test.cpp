// Renderers against closed forms, against each other and against rays.
#include "sim/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace lensd::sim {
namespace {

/// 25 mm lens, 5 um pixels.
Scene EmptyScene(int width, int height) {
  Scene scene;
  scene.camera.width = width;
  scene.camera.height = height;
  scene.camera.pixel_um = 5.0;
  return scene;
}

Surface Wall(double vergence_d, Paint paint, Region region = {}) {
  return {PlaneShape{vergence_d, 0.0, 0.0}, region, std::move(paint)};
}

/// Independent values in [0, 1], one a texel.
TexturePaint Noise(int width, int height, std::uint32_t seed) {
  auto texture = std::make_shared<Texture>();
  texture->width = width;
  texture->height = height;
  for (int i = 0; i < width * height; ++i) {
    seed = seed * 1664525u + 1013904223u;
    texture->light.push_back(static_cast<float>(seed >> 8) / 16777216.0f);
  }
  return {texture, 1.0, false};
}

/// A thin lens whose blur disk at vergence `at_d` has this signed diameter, positive behind the focal plane.
OpticalState Blurred(const Scene& scene, double diameter_px, double at_d) {
  const double f = 0.025;
  const double aperture = 0.01;
  const double blur = diameter_px * scene.camera.pixel_um * 1e-6;
  return {LensModel::Thin, f, aperture, (1.0 + blur / aperture) / (1.0 / f - at_d)};
}

LightImage Render(const Scene& scene, const OpticalState& state, RenderOptions options = {}) {
  auto renderer = Renderer::Create(scene);
  EXPECT_TRUE(renderer);
  auto rendered = renderer->Render(state, options);
  EXPECT_TRUE(rendered);
  return std::move(rendered->image);
}

double LargestDifference(const LightImage& a, const LightImage& b) {
  EXPECT_EQ(a.light.size(), b.light.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < a.light.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(a.light[i]) - static_cast<double>(b.light[i])));
  }
  return largest;
}

TEST(Render, SharpWallIsItsTexture) {
  Scene scene = EmptyScene(40, 30);
  const TexturePaint noise = Noise(40, 30, 1);
  scene.surfaces.push_back(Wall(1.0, noise));
  for (const Algorithm algorithm : {Algorithm::Auto, Algorithm::Rays}) {
    const LightImage image = Render(scene, Blurred(scene, 0.0, 1.0), {.algorithm = algorithm, .rays_per_pixel = 64});
    EXPECT_EQ(image.light, noise.texture->light);
  }
}

TEST(Render, BlurredWallAgreesWithRays) {
  Scene scene = EmptyScene(24, 20);
  scene.surfaces.push_back(Wall(1.0, Noise(30, 22, 2)));
  for (const double diameter : {-1.7, 3.0, -9.3, 14.0}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    EXPECT_NEAR(SignedBlurPx(scene.camera, state, 1.0), diameter, 1e-9);
    const LightImage rays = Render(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 30000});
    const LightImage quick = Render(scene, state);
    EXPECT_LT(LargestDifference(rays, quick), 1e-3) << diameter;
  }
}

TEST(Render, RegionIsPartOfTheFrame) {
  Scene scene = EmptyScene(60, 50);
  scene.surfaces.push_back(Wall(1.0, Noise(60, 50, 3)));
  const OpticalState state = Blurred(scene, 7.0, 1.0);
  const LightImage all = Render(scene, state);
  const LightImage part = Render(scene, state, {.region = PixelRect{11, 7, 20, 30}});
  ASSERT_EQ(part.light.size(), 600u);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 20; ++x) {
      EXPECT_NEAR(part.light[static_cast<std::size_t>(y * 20 + x)],
                  all.light[static_cast<std::size_t>((y + 7) * 60 + x + 11)], 1e-6);
    }
  }
}

TEST(Render, RefusesNonsense) {
  Scene scene = EmptyScene(20, 10);
  auto renderer = Renderer::Create(scene);
  ASSERT_TRUE(renderer);
  EXPECT_FALSE(renderer->Render({LensModel::Thin, 0.0, 0.01, 0.025}));
  EXPECT_FALSE(renderer->Render({}, {.region = PixelRect{0, 0, 21, 3}}));
  scene.camera.width = 0;
  EXPECT_FALSE(Renderer::Create(scene));
}

}  // namespace
}  // namespace lensd::sim
