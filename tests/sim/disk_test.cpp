// Blur by disks against the sum itself, in double precision, over the kernel's exact areas.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include <hwy/highway.h>
#include <algorithm>

#include "render_scenes.h"
#include "sim/render/disk_filter.h"
#include "sim/render/disk_fourier.h"
#include "sim/render/varying_blur.h"

namespace lensd::sim {
namespace {

Raster NoiseOver(PixelRect rect, std::uint32_t seed) {
  Raster raster(rect);
  for (float& value : raster.values) {
    seed = seed * 1664525u + 1013904223u;
    value = static_cast<float>(seed >> 8) / 16777216.0f;
  }
  return raster;
}

double SumAt(const Raster& source, const DiskKernel& kernel, int x, int y) {
  double sum = 0.0;
  for (int dy = -kernel.reach; dy <= kernel.reach; ++dy) {
    for (int dx = -kernel.reach; dx <= kernel.reach; ++dx) {
      sum += kernel.At(dx, dy) * static_cast<double>(source.At(x + dx, y + dy));
    }
  }
  return sum;
}

/// What a kernel leaves of a wave of u and v cycles a pixel.
double TransformOf(const DiskKernel& kernel, double u, double v) {
  double sum = 0.0;
  for (int y = -kernel.reach; y <= kernel.reach; ++y) {
    for (int x = -kernel.reach; x <= kernel.reach; ++x) {
      sum += kernel.At(x, y) * std::cos(2.0 * std::numbers::pi * (u * x + v * y));
    }
  }
  return sum;
}

TEST(DiskKernel, CoversWhatItsAreaIs) {
  // Against the area summed over thin strips, for a disk somewhere on the grid.
  for (const double diameter : {1.3, 5.0, 12.7}) {
    for (const auto& [x0, y0] : {std::pair(-0.5, -0.5), {0.2, 1.1}, {1.0, -2.9}, {-5.1, 2.0}}) {
      const int strips = 200000;
      double area = 0.0;
      for (int i = 0; i < strips; ++i) {
        const double x = x0 + (i + 0.5) / strips;
        const double half = 0.25 * diameter * diameter - x * x;
        if (half <= 0.0) continue;
        const double h = std::sqrt(half);
        area += std::max(0.0, std::min(h, y0 + 1.0) - std::max(-h, y0)) / strips;
      }
      EXPECT_NEAR(DiskInRectangle(diameter, x0, y0, x0 + 1.0, y0 + 1.0), area, 1e-6);
    }
    EXPECT_NEAR(DiskInRectangle(diameter, -50, -50, 50, 50), std::numbers::pi * diameter * diameter / 4.0, 1e-9);
  }
}

/// A large disk's kernel against the disk's own transform below 0.45 cycles a pixel, in every direction: off by less
/// than half of what shares of area are. And what it makes of a step.
TEST(DiskKernel, LargeDisksKeepTheDisksTransform) {
  std::mt19937 random(31);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  constexpr int kFrequencies = 300;
  double worst = 0.0, worst_mean = 0.0, mean_of_areas = 0.0;
  for (int i = 0; i < 60; ++i) {
    const double diameter = uniform(8.125, i < 20 ? 12.0 : 60.0);
    const DiskKernel kernel(diameter), areas = DiskKernel::Sparse(diameter);
    const double unit = std::pow(diameter, -1.5);  // as the transform itself falls
    double squares = 0.0, squares_of_areas = 0.0;
    for (int k = 0; k < kFrequencies; ++k) {
      const double f = 0.45 * std::sqrt(uniform(0.0, 1.0)), angle = uniform(0.0, 2.0 * std::numbers::pi);
      const double u = f * std::cos(angle), v = f * std::sin(angle), x = std::numbers::pi * diameter * f;
      const double disk = x < 1e-6 ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
      const double off = TransformOf(kernel, u, v) - disk;
      squares += off * off / kFrequencies;
      squares_of_areas += std::pow(TransformOf(areas, u, v) - disk, 2.0) / kFrequencies;
      worst = std::max(worst, std::abs(off) / unit);
      EXPECT_LT(std::abs(off), 0.55 * unit) << diameter << " px at " << u << ", " << v;
      if (f <= 0.4) {
        EXPECT_LT(std::abs(off), 0.3 * unit) << diameter << " px at " << u << ", " << v;
      }
    }
    EXPECT_LT(std::sqrt(squares), 0.13 * unit) << diameter;
    worst_mean = std::max(worst_mean, std::sqrt(squares) / unit);
    mean_of_areas = std::max(mean_of_areas, std::sqrt(squares_of_areas) / unit);
    double sum = 0.0;
    for (int column = -kernel.reach; column <= kernel.reach; ++column) {
      for (int y = -kernel.reach; y <= kernel.reach; ++y) sum += kernel.At(column, y);
      EXPECT_GT(sum, -0.01) << diameter;
      EXPECT_LT(sum, 1.01) << diameter;
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
  }
  EXPECT_LT(worst_mean, 0.5 * mean_of_areas);
  std::printf("off by at most %.3f d^-1.5, root mean square %.3f; shares of area %.3f\n", worst, worst_mean,
              mean_of_areas);
}

TEST(DiskFilter, EveryMethodIsTheSum) {
  const PixelRect rect{3, -2, 70, 37};
  for (const double diameter : {0.5, 1.0, 2.3, 5.0, 15.0, 40.6}) {
    const DiskKernel kernel(diameter);
    const Raster source = NoiseOver(Grown(rect, kernel.reach), 5);
    const SummedRaster summed(source);
    Raster direct(rect);
    Raster runs(rect);
    Raster fourier(rect);
    DiskFilter(diameter, DiskFilter::Method::Direct).Blur(summed, direct);
    DiskFilter(diameter, DiskFilter::Method::Runs).Blur(summed, runs);
    Raster by_bands(rect);
    DiskFilter(diameter, DiskFilter::Method::Runs).Blur(source, by_bands);
    DiskFourier(diameter, rect.width, rect.height).Blur(source, fourier);
    for (int y = rect.y; y < rect.y + rect.height; ++y) {
      for (int x = rect.x; x < rect.x + rect.width; ++x) {
        const double expected = SumAt(source, kernel, x, y);
        ASSERT_NEAR(static_cast<double>(direct.At(x, y)), expected, 1e-6) << diameter;
        ASSERT_NEAR(static_cast<double>(runs.At(x, y)), expected, 2e-6) << diameter;
        ASSERT_NEAR(static_cast<double>(by_bands.At(x, y)), expected, 2e-6) << diameter;
        ASSERT_NEAR(static_cast<double>(fourier.At(x, y)), expected, 1e-6) << diameter;
      }
    }
  }
}

/// A sinusoid keeps its shape under any symmetric kernel: it is multiplied by the kernel's transfer function.
TEST(DiskFilter, SinusoidKeepsTheKernelsTransfer) {
  const PixelRect rect{0, 0, 64, 20};
  for (const double diameter : {3.0, 9.5, 24.0}) {
    const DiskKernel kernel(diameter);
    for (const double period : {5.3, 17.0}) {
      const double w = 2.0 * std::numbers::pi / period;
      double transfer = 0.0;
      for (int y = -kernel.reach; y <= kernel.reach; ++y) {
        for (int x = -kernel.reach; x <= kernel.reach; ++x) transfer += kernel.At(x, y) * std::cos(w * x);
      }
      Raster source(Grown(rect, kernel.reach));
      for (int y = source.rect.y; y < source.rect.y + source.rect.height; ++y) {
        for (int i = 0; i < source.rect.width; ++i) {
          source.Row(y)[i] = static_cast<float>(0.5 + 0.5 * std::cos(w * (source.rect.x + i)));
        }
      }
      Raster quick(rect);
      Raster fourier(rect);
      DiskFilter(diameter).Blur(source, quick);
      DiskFourier(diameter, rect.width, rect.height).Blur(source, fourier);
      for (int x = 0; x < rect.width; ++x) {
        const double expected = 0.5 + 0.5 * transfer * std::cos(w * x);
        ASSERT_NEAR(static_cast<double>(quick.At(x, 9)), expected, 1e-6);
        ASSERT_NEAR(static_cast<double>(fourier.At(x, 9)), expected, 1e-6);
      }
    }
  }
}

/// Everything rendered here, to the last bit.
std::vector<float> RenderAll() {
  std::vector<float> all;
  const PixelRect rect{0, 0, 83, 21};
  const auto keep = [&](const Raster& raster) { all.insert(all.end(), raster.values.begin(), raster.values.end()); };
  for (const double diameter : {4.3, 13.0}) {
    const Raster source = NoiseOver(Grown(rect, DiskKernel(diameter).reach), 7);
    Raster image(rect);
    DiskFilter(diameter, DiskFilter::Method::Direct).Blur(source, image);
    keep(image);
    DiskFilter(diameter, DiskFilter::Method::Runs).Blur(source, image);
    keep(image);
    DiskFourier(diameter, rect.width, rect.height).Blur(source, image);
    keep(image);
  }
  const Scene scene = TwoLayers(0.6, 3);
  for (const Algorithm algorithm : {Algorithm::Auto, Algorithm::March, Algorithm::Gather}) {
    const LightImage image = Render(scene, Blurred(scene, 6.0, 0.8), {.algorithm = algorithm, .rays_per_pixel = 300});
    all.insert(all.end(), image.light.begin(), image.light.end());
  }
  return all;
}

TEST(Render, EveryInstructionSetGivesTheSameBits) {
  const std::vector<float> best = RenderAll();
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    const std::vector<float> other = RenderAll();
    EXPECT_TRUE(std::equal(best.begin(), best.end(), other.begin(), other.end())) << hwy::TargetName(target);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

TEST(VaryingBlur, EveryPixelHasItsOwnDisk) {
  const PixelRect rect{0, 0, 300, 24};
  const Raster source = NoiseOver(Grown(rect, ReachOf(41.0)), 6);
  Raster diameters(rect);
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) diameters.Row(y)[x] = 41.0f * static_cast<float>(x) / 299.0f;
  }
  Raster image(rect);
  BlurVarying(SummedRaster(source), diameters, image);
  for (int x = 0; x < rect.width; ++x) {
    const double expected = SumAt(source, DiskKernel::Sparse(static_cast<double>(diameters.At(x, 11))), x, 11);
    EXPECT_NEAR(static_cast<double>(image.At(x, 11)), expected, 0.25 / 255.0) << diameters.At(x, 11);
  }
}

}  // namespace
}  // namespace lensd::sim
