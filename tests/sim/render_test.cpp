// Renderers against each other and their limits.
#include <gtest/gtest.h>

#include "render_scenes.h"

namespace lensd::sim {
namespace {

TEST(Render, SharpWallIsItsTexture) {
  Scene scene = EmptyScene(40, 30);
  const TexturePaint noise = WhiteNoise(40, 30, 1);
  scene.surfaces.push_back(Wall(1.0, noise));
  EXPECT_EQ(Render(scene, Blurred(scene, 0.0, 1.0)).light, noise.texture->light);
  EXPECT_EQ(Render(scene, {LensModel::Pinhole, 0.025, 0.01, 0.027}, {.algorithm = Algorithm::Rays}).light,
            noise.texture->light);
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

TEST(Render, ThinLensHasItsLimits) {
  Scene scene = EmptyScene(20, 16);
  scene.surfaces.push_back(Wall(1.0, Noise(20, 16, 4)));
  const RenderOptions rays{.algorithm = Algorithm::Rays, .rays_per_pixel = 500};
  for (const RenderOptions& options : {RenderOptions{}, rays}) {
    const OpticalState no_hole{LensModel::Thin, 0.025, 0.0, 0.027};
    EXPECT_EQ(Render(scene, no_hole, options).light,
              Render(scene, {LensModel::Pinhole, 0.025, 0.01, 0.027}, options).light);
    // Without power the cone goes on spreading: a hole of 20 um before a wall at 1 m, 27 mm in front of the sensor.
    const OpticalState no_power{LensModel::Thin, 1e12, 20e-6, 0.027};
    const OpticalState no_lens{LensModel::Aperture, 0.025, 20e-6, 0.027};
    EXPECT_NEAR(-SignedBlurPx(scene.camera, no_lens, 1.0), 20.0 * (1.0 + 0.027) / 5.0, 1e-12);
    EXPECT_LT(LargestDifference(Render(scene, no_power, options), Render(scene, no_lens, options)), 1e-7);
  }
}

TEST(Render, RaysInStepAreTheSameRays) {
  Scene scene = EmptyScene(50, 24);
  auto depth = std::make_shared<DepthMap>();
  *depth = {50, 24, {}};
  for (int i = 0; i < 50 * 24; ++i)
    depth->depth_m.push_back(i % 50 < 20 ? 0.8f : 1.0f + 0.02f * static_cast<float>(i % 7));
  TexturePaint paint = Noise(50, 24, 7);
  paint.stretched = true;
  scene.surfaces.push_back({DepthMapShape{depth}, {}, paint});
  scene.surfaces.push_back(Wall(1.1, Noise(50, 24, 8), {0.7, 0.2, 0.1, 0.5}));
  for (const double diameter : {0.0, 6.0, -9.0}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    const LightImage single = Render(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 700});
    const LightImage in_step = Render(scene, state, {.algorithm = Algorithm::March, .rays_per_pixel = 700});
    // Single and double precision may disagree on a ray that grazes an edge.
    EXPECT_LT(Percentile(single, in_step, 0.99), 1e-5) << diameter;
    EXPECT_LT(LargestDifference(single, in_step), 5.0 / 700.0) << diameter;
  }
}

TEST(Render, AutoPicksTheCheapest) {
  const auto chosen = [](const Scene& scene, double tolerance) {
    return Renderer::Create(scene)
        ->Render(Blurred(scene, 6.0, 1.0), {.tolerance = tolerance, .rays_per_pixel = 64})
        ->algorithm;
  };
  Scene sinusoid = EmptyScene(32, 32);
  sinusoid.surfaces.push_back(Wall(1.0, SinusoidPaint{8.0, 0.0}));
  EXPECT_EQ(chosen(sinusoid, 0.002), Algorithm::Fourier);
  Scene hidden = EmptyScene(32, 32);
  hidden.surfaces.push_back(Wall(1.0, Noise(32, 32, 1)));
  hidden.surfaces.push_back(Wall(0.5, Noise(32, 32, 1)));
  EXPECT_EQ(chosen(hidden, 0.002), Algorithm::Wall);
  Scene tilted = EmptyScene(32, 32);
  tilted.surfaces.push_back({PlaneShape{1.0, 0.01, 0.0}, {}, Noise(32, 32, 1)});
  EXPECT_EQ(chosen(tilted, 0.02), Algorithm::Gather);
  EXPECT_EQ(chosen(tilted, 1e-5), Algorithm::Rays);
  EXPECT_EQ(chosen(TwoLayers(0.6, 1), 0.002), Algorithm::Hybrid);
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
