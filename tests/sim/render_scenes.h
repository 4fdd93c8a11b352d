// Small scenes and comparisons for the tests of the renderers.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "sim/render.h"

namespace lensd::sim {

/// 25 mm lens, 5 um pixels.
inline Scene EmptyScene(int width, int height) {
  Scene scene;
  scene.camera.width = width;
  scene.camera.height = height;
  scene.camera.pixel_um = 5.0;
  return scene;
}

inline Surface Wall(double vergence_d, Paint paint, Region region = {}) {
  return {PlaneShape{vergence_d, 0.0, 0.0}, region, std::move(paint)};
}

/// Independent values in [0, 1], one a texel.
inline TexturePaint WhiteNoise(int width, int height, std::uint32_t seed) {
  auto texture = std::make_shared<Texture>();
  texture->width = width;
  texture->height = height;
  for (int i = 0; i < width * height; ++i) {
    seed = seed * 1664525u + 1013904223u;
    texture->light.push_back(static_cast<float>(seed >> 8) / 16777216.0f);
  }
  return {texture, 1.0, false};
}

/// Everything from 0 to 1, waves of all periods from 2.6 px up in every direction, none shorter: what the pixel means
/// of a picture may be that rays and kernels must agree on. It goes on smoothly where it is mirrored.
inline TexturePaint Noise(int width, int height, std::uint32_t seed) {
  auto texture = std::make_shared<Texture>(Texture{width, height, {}});
  const auto wave = [](int repeats, int at, int size) { return std::cos(M_PI * repeats * (at + 0.5) / size); };
  std::vector<double> light(static_cast<std::size_t>(width * height));
  for (int down = 0; down < height; ++down) {
    std::vector<double> row(static_cast<std::size_t>(width));
    for (int along = 0; along < width; ++along) {
      if (std::hypot(0.5 * along / width, 0.5 * down / height) > 1.0 / 2.6) continue;
      seed = seed * 1664525u + 1013904223u;
      const double amplitude = static_cast<double>(seed >> 8) / 16777216.0 - 0.5;
      for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] += amplitude * wave(along, x, width);
    }
    for (int i = 0; i < width * height; ++i)
      light[static_cast<std::size_t>(i)] += row[static_cast<std::size_t>(i % width)] * wave(down, i / width, height);
  }
  const auto [low, high] = std::minmax_element(light.begin(), light.end());
  for (const double value : light) texture->light.push_back(static_cast<float>((value - *low) / (*high - *low)));
  return {texture, 1.0, false};
}

/// What fitted kernels and parabolas may leave of Noise's contrast, beside a renderer's own error: of waves of 2.6 px
/// alone it would be a hundredth.
constexpr double kLeftByFits = 0.003;

/// A thin lens whose blur disk at vergence `at_d` has this signed diameter, positive behind the focal plane.
inline OpticalState Blurred(const Scene& scene, double diameter_px, double at_d) {
  const double f = 0.025;
  const double aperture = 0.01;
  const double blur = diameter_px * scene.camera.pixel_um * 1e-6;
  return {LensModel::Thin, f, aperture, (1.0 + blur / aperture) / (1.0 / f - at_d)};
}

inline LightImage Render(const Scene& scene, const OpticalState& state, const RenderOptions& options = {}) {
  auto renderer = Renderer::Create(scene);
  EXPECT_TRUE(renderer);
  auto rendered = renderer->Render(state, options);
  EXPECT_TRUE(rendered);
  return std::move(rendered->image);
}

inline double LargestDifference(const LightImage& a, const LightImage& b) {
  EXPECT_EQ(a.light.size(), b.light.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < a.light.size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(a.light[i]) - static_cast<double>(b.light[i])));
  }
  return largest;
}

/// Absolute difference that only a given share of the pixels exceeds.
inline double Percentile(const LightImage& a, const LightImage& b, double share,
                         const std::vector<char>* only = nullptr) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.light.size(); ++i) {
    if (only != nullptr && (*only)[i] == 0) continue;
    differences.push_back(std::abs(static_cast<double>(a.light[i]) - static_cast<double>(b.light[i])));
  }
  if (differences.empty()) return 0.0;
  std::sort(differences.begin(), differences.end());
  return differences[static_cast<std::size_t>(share * static_cast<double>(differences.size() - 1))];
}

/// A textured wall behind, a textured strip in front.
inline Scene TwoLayers(double strip_width, std::uint32_t seed) {
  Scene scene = EmptyScene(72, 48);
  scene.surfaces.push_back(Wall(0.5, Noise(72, 48, seed)));
  scene.surfaces.push_back(Wall(1.0, Noise(72, 48, seed + 1), {0.4, 0.0, strip_width, 1.0}));
  return scene;
}

}  // namespace lensd::sim
