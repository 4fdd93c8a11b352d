// Renderers against closed forms and against rays without end.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>

#include "render_scenes.h"

namespace lensd::sim {
namespace {

TEST(Render, BlurredWallAgreesWithRays) {
  Scene scene = EmptyScene(24, 20);
  scene.surfaces.push_back(Wall(1.0, Noise(30, 22, 2)));
  for (const double diameter : {-1.7, 3.0, -9.3, 14.0}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    EXPECT_NEAR(SignedBlurPx(scene.camera, state, 1.0), diameter, 1e-9);
    const LightImage rays = Render(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 30000});
    const LightImage quick = Render(scene, state);
    EXPECT_LT(LargestDifference(rays, quick), kLeftByFits) << diameter;
  }
}

/// 2 J1(x) / x by its integral, the mean of cos(x t) over a disk's chords: (4 / pi) int_0^1 sqrt(1 - t^2) cos(x t) dt,
/// with t = sin a, by the trapezoid rule, which converges at once for this periodic integrand.
double DiskTransferByIntegral(double x) {
  const int steps = 4000;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / steps;
    sum += std::cos(angle) * std::cos(angle) * std::cos(x * std::sin(angle));
  }
  return 2.0 * sum / steps;
}

TEST(Render, SinusoidKeepsTheDisksTransfer) {
  for (const auto& [period_x, period_y] : {std::pair(8.0, 0.0), std::pair(0.0, 5.5), std::pair(12.0, 7.0)}) {
    Scene scene = EmptyScene(12, 8);
    scene.surfaces.push_back(Wall(1.0, SinusoidPaint{period_x, period_y}));
    const double frequency = std::hypot(period_x > 0.0 ? 1.0 / period_x : 0.0, period_y > 0.0 ? 1.0 / period_y : 0.0);
    for (const double diameter : {-0.4, 3.0, -11.0, 20.0}) {
      const OpticalState state = Blurred(scene, diameter, 1.0);
      const double transfer = DiskTransferByIntegral(std::numbers::pi * diameter * frequency);
      const LightImage closed = Render(scene, state);
      const LightImage rays = Render(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 28657});
      for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 12; ++x) {
          const auto wave = [](double at, double period) {
            return period > 0.0 ? std::cos(2.0 * std::numbers::pi * at / period) : 1.0;
          };
          const double expected = 0.5 + 0.5 * transfer * wave(x + 0.5, period_x) * wave(y + 0.5, period_y);
          const auto i = static_cast<std::size_t>(y * 12 + x);
          ASSERT_NEAR(static_cast<double>(closed.light[i]), expected, 1e-6) << diameter;
          ASSERT_NEAR(static_cast<double>(rays.light[i]), expected, 1e-6) << diameter;
        }
      }
    }
  }
}

TEST(Render, ForwardAndReverseProjectionAgree) {
  Scene wall = EmptyScene(24, 20);
  wall.surfaces.push_back(Wall(1.0, Noise(24, 20, 5)));
  Scene plane = EmptyScene(40, 20);
  plane.surfaces.push_back({PlaneShape{1.0, 0.02, 0.01}, {}, Noise(10, 8, 6)});
  std::get<TexturePaint>(plane.surfaces[0].paint).texture_px_per_image_px = 0.25;
  for (const auto& [scene, diameter, limit] :
       {std::tuple(wall, 7.3, kLeftByFits), std::tuple(plane, 9.0, 4e-3), std::tuple(plane, -6.0, 4e-3)}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    const LightImage reverse = Render(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 30000});
    const LightImage forward = Render(scene, state, {.algorithm = Algorithm::Splat});
    EXPECT_LT(LargestDifference(reverse, forward), limit) << diameter;
  }
}

TEST(Render, AutoMatchesRaysWhereThingsHideEachOther) {
  const double strip = 0.6;
  const double wire = 2.0 / 72.0;
  for (const double width : {strip, wire}) {
    const Scene scene = TwoLayers(width, 10);
    for (const double focus_d : {1.0, 0.75, 1.4}) {
      OpticalState state = Blurred(scene, 0.0, focus_d);
      state.aperture_diameter_m = 0.008;
      const LightImage truth = Render(scene, state, {.algorithm = Algorithm::March, .rays_per_pixel = 150000});
      auto renderer = Renderer::Create(scene);
      const auto rendered = renderer->Render(state, {});
      std::vector<char> boundary;
      const double reach = 0.5 * std::max(std::abs(SignedBlurPx(scene.camera, state, 1.0)),
                                          std::abs(SignedBlurPx(scene.camera, state, 0.5))) +
                           1.0;
      for (int i = 0; i < 72 * 48; ++i) {
        const double x = i % 72 + 0.5;
        boundary.push_back(std::abs(x - 29.0) < reach || (width == wire && std::abs(x - 31.0) < reach));
      }
      EXPECT_LT(Percentile(truth, rendered->image, 0.999, &boundary), 0.5 / 255.0 + kLeftByFits)
          << width << ' ' << focus_d;
      EXPECT_LT(Percentile(truth, rendered->image, 0.999), 0.5 / 255.0 + kLeftByFits) << width << ' ' << focus_d;
      EXPECT_LE(rendered->error_bound, 0.5 / 255.0);
    }
  }
}

TEST(Render, AutoMatchesRaysOnTiltedPlanes) {
  for (const auto& [slope_x, slope_y] : {std::pair(0.01, 0.0), std::pair(0.012, -0.02), std::pair(-0.036, 0.02)}) {
    Scene scene = EmptyScene(24, 16);
    scene.surfaces.push_back({PlaneShape{1.0, slope_x, slope_y}, {}, Noise(24, 16, 3)});
    for (const double diameter : {0.0, 3.0, -7.5, 16.0, 70.0}) {  // at 1 D; 0: the focal plane cuts through the picture
      OpticalState state = Blurred(scene, diameter, 1.0);
      state.aperture_diameter_m = 0.008;
      const LightImage truth = Render(scene, state, {.algorithm = Algorithm::Rays, .rays_per_pixel = 60000});
      const auto rendered = Renderer::Create(scene)->Render(state, {});
      ASSERT_TRUE(rendered);
      EXPECT_EQ(rendered->algorithm, Algorithm::Plane) << slope_x << ' ' << diameter;
      // Both stand on parabolas between the samples.
      EXPECT_LT(LargestDifference(truth, rendered->image), rendered->error_bound + 2.0 * kLeftByFits)
          << slope_x << ' ' << diameter;
      EXPECT_LE(rendered->error_bound, 0.5 / 255.0) << slope_x << ' ' << diameter;
    }
  }
}

/// A mirrored picture blurred by the disk's transform: its cosines one by one, each times what the disk leaves of it.
LightImage BlurredByTransform(const LightImage& sharp, double diameter) {
  const int w = sharp.width, h = sharp.height;
  const auto wave = [](int k, int at, int size) { return std::cos(std::numbers::pi * k * (at + 0.5) / size); };
  LightImage blurred{w, h, std::vector<float>(sharp.light.size())};
  std::vector<double> sums(sharp.light.size());
  for (int ky = 0; ky < h; ++ky) {
    for (int kx = 0; kx < w; ++kx) {
      double coefficient = (kx > 0 ? 2.0 : 1.0) * (ky > 0 ? 2.0 : 1.0) / (w * h);
      double sum = 0.0;
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x)
          sum +=
              static_cast<double>(sharp.light[static_cast<std::size_t>(y * w + x)]) * wave(kx, x, w) * wave(ky, y, h);
      }
      coefficient *= sum * DiskTransferByIntegral(std::numbers::pi * diameter * std::hypot(0.5 * kx / w, 0.5 * ky / h));
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x)
          sums[static_cast<std::size_t>(y * w + x)] += coefficient * wave(kx, x, w) * wave(ky, y, h);
      }
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) blurred.light[i] = static_cast<float>(std::max(sums[i], 0.0));
  return blurred;
}

/// Four octaves of noise, the finest a value a pixel, as lively as a photograph: what `auto` takes for half a level.
TEST(Render, AWallOfNoiseIsWithinHalfALevelOfRays) {
  constexpr int kWide = 64, kHigh = 48;
  Scene scene = EmptyScene(kWide, kHigh);
  auto texture = std::make_shared<Texture>(Texture{kWide, kHigh, std::vector<float>(kWide * kHigh, 0.5f)});
  for (const int size : {1, 2, 4, 8}) {
    const TexturePaint octave = WhiteNoise(kWide / size, kHigh / size, 40u + static_cast<std::uint32_t>(size));
    for (int i = 0; i < kWide * kHigh; ++i) {
      const int cell = i / kWide / size * (kWide / size) + i % kWide / size;
      texture->light[static_cast<std::size_t>(i)] +=
          0.25f * (octave.texture->light[static_cast<std::size_t>(cell)] - 0.5f);
    }
  }
  scene.surfaces.push_back(Wall(1.0, TexturePaint{texture, 1.0, false}));
  double worst = 0.0;
  for (const double diameter : {8.4, 9.3, 10.2, 11.6, 14.9, 21.3}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    const LightImage rays = Render(scene, state, {.algorithm = Algorithm::March, .rays_per_pixel = 100000});
    const double off = Percentile(rays, Render(scene, state), 0.999);
    EXPECT_LT(off, 0.5 / 255.0) << diameter;
    worst = std::max(worst, off);
  }
  std::printf("off by at most %.2f of 255\n", 255.0 * worst);
}

TEST(Render, NoiseAsFineAsThePixelsIsOffByWhatIsStated) {
  Scene scene = EmptyScene(32, 24);
  scene.surfaces.push_back(Wall(1.0, WhiteNoise(32, 24, 11)));
  const LightImage sharp = Render(scene, Blurred(scene, 0.0, 1.0));
  const auto renderer = Renderer::Create(scene);
  for (const double diameter : {0.7, 2.1, 4.4, 7.9, 8.3, 9.6, 12.7, 19.2, 31.0}) {
    const OpticalState state = Blurred(scene, diameter, 1.0);
    const auto rendered = renderer->Render(state);
    ASSERT_TRUE(rendered);
    ASSERT_EQ(rendered->algorithm, Algorithm::Wall);
    const double stated = rendered->error_bound + renderer->ShortPeriodError(state);
    const double off = Percentile(BlurredByTransform(sharp, diameter), rendered->image, 0.999);
    EXPECT_LT(off, stated) << diameter;
    EXPECT_GT(off, 0.1 * stated) << diameter << ": stated so wide, it says nothing";
  }
  TexturePaint coarse = Noise(8, 6, 1);
  coarse.texture_px_per_image_px = 0.1;
  scene.surfaces.front().paint = coarse;
  const auto smooth = Renderer::Create(scene);
  EXPECT_LT(smooth->ShortPeriodError(Blurred(scene, 12.0, 1.0)),
            0.1 * renderer->ShortPeriodError(Blurred(scene, 12.0, 1.0)));
}

}  // namespace
}  // namespace lensd::sim
