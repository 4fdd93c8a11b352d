// Pictures are shared by lens states that look the same, and forgotten within their budget of memory.
#include "sim/pictures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/camera/lens_grid.h"
#include "stage.h"

namespace lensd::sim {
namespace {

/// Blur of the subject nearest to focus: 0 where the focal plane lies among the subjects.
double NearestBlur(const CameraSettings& camera, const OpticalState& state, const VergenceSpan& span) {
  const double far_px = SignedBlurPx(camera, state, span.far_d);
  const double near_px = SignedBlurPx(camera, state, span.near_d);
  if (far_px * near_px <= 0.0) return 0.0;
  return std::min(std::abs(far_px), std::abs(near_px));
}

TEST(LensGrid, RoundsWithinItsWord) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    Scene scene = SmallScene();
    const double far_d = 2.0 * uniform(random);
    const double near_d = far_d + (i % 2 == 0 ? 0.0 : uniform(random));
    scene.surfaces = {{PlaneShape{far_d, 0, 0}, {}, ConstantPaint{}}, {PlaneShape{near_d, 0, 0}, {}, ConstantPaint{}}};
    const LensGrid grid(scene);
    OpticalState state;
    state.focal_length_m = 0.01 + 0.09 * uniform(random);
    state.aperture_diameter_m = state.focal_length_m / std::exp(0.3 + 2.5 * uniform(random));
    const double span_m = state.focal_length_m * state.focal_length_m * (near_d + 0.5);
    state.sensor_distance_m = state.focal_length_m + span_m * (1.4 * uniform(random) - 0.2);
    const LensGrid::Key key = grid.KeyOf(state);
    const OpticalState rounded = grid.StateOf(key);
    ASSERT_EQ(grid.KeyOf(rounded), key);
    EXPECT_NEAR(std::log(rounded.aperture_diameter_m / state.aperture_diameter_m), 0.0, 1.0 / 512.0 + 1e-12);
    OpticalState same_size = rounded;
    same_size.aperture_diameter_m = state.aperture_diameter_m;
    const VergenceSpan span = SpanOf(scene);
    const double least = NearestBlur(scene.camera, state, span);
    // The focal length's rounding, 5e-7, moves the extensions that focus by up to three times that of themselves.
    const double focal = 1.5e-6 * std::abs(state.sensor_distance_m - state.focal_length_m) * state.aperture_diameter_m /
                         state.sensor_distance_m / (scene.camera.pixel_um * 1e-6);
    const double allowed = std::max(1.0 / 128.0, least / 256.0) * 1.05 + focal;
    for (const double vergence : {far_d, near_d}) {
      EXPECT_NEAR(SignedBlurPx(scene.camera, same_size, vergence), SignedBlurPx(scene.camera, state, vergence), allowed)
          << "least " << least;
    }
  }
}

TEST(Pictures, AreSharedByStatesThatLookTheSame) {
  Scene scene = SmallScene();
  scene.surfaces[0].paint = SinusoidPaint{8.0, 0.0};
  const auto pictures = *Pictures::Create(std::make_shared<const Scene>(scene));
  OpticalState state{LensModel::Thin, 0.025, 0.0125, 0.0256};
  const auto first = *pictures->At(state);
  state.sensor_distance_m += 1e-9;
  EXPECT_EQ(*pictures->At(state), first);
  state.sensor_distance_m += 5e-6;
  EXPECT_NE(*pictures->At(state), first);
}

TEST(Pictures, ForgetTheLongestUnusedWithinTheirBudget) {
  Scene scene = SmallScene();
  scene.surfaces[0].paint = SinusoidPaint{8.0, 0.0};
  const auto pictures = *Pictures::Create(std::make_shared<const Scene>(scene), 4500);  // for two, of 1,850 each
  const auto at = [&](double extension_um) {
    return *pictures->At({LensModel::Thin, 0.025, 0.0125, 0.025 + 1e-6 * extension_um});
  };
  const auto first = at(100);
  const auto second = at(200);
  EXPECT_EQ(at(100), first);
  at(300);
  EXPECT_EQ(at(100), first);
  EXPECT_NE(at(200), second);
}

TEST(Pictures, KeepLightTo16Bits) {
  Scene scene = SmallScene();
  scene.surfaces[0].paint = SinusoidPaint{8.0, 0.0};
  scene.lights.push_back({0.5, 0.5, 1.0, 30.0});
  const auto shared = std::make_shared<const Scene>(scene);
  const auto pictures = *Pictures::Create(shared);
  const OpticalState state{LensModel::Pinhole, 0.025, 0.0, 0.025};
  const auto picture = *pictures->At(state);
  const auto renderer = *Renderer::Create(scene);
  const auto rendered = *renderer.Render(state);
  std::vector<float> light(picture->light.begin(), picture->light.end());
  for (float& value : light) value /= 65535.0f;
  for (const auto& bright : picture->bright) light[bright.index] = bright.light;
  EXPECT_FALSE(picture->bright.empty());
  for (std::size_t i = 0; i < light.size(); ++i) EXPECT_NEAR(light[i], rendered.image.light[i], 0.51 / 65535.0);
}

}  // namespace
}  // namespace lensd::sim
