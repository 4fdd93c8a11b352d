// Colour beside luminance.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "base/clock.h"
#include "sim/world.h"
#include "stage.h"

namespace lensd::sim {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Colour, ChannelsAreTheTexturesAndLuminanceIsWhatTheyAddUpTo) {
  auto texture = std::make_shared<Texture>(Texture{1, 1, {0.0f}});
  texture->colour = {std::vector<float>{0.9f}, {0.5f}, {0.2f}};
  Scene scene;
  scene.camera.width = 16;
  scene.camera.height = 8;
  scene.camera.bits = 16;
  scene.camera.colour = true;
  scene.lens.model = LensModel::Pinhole;
  scene.surfaces.push_back({.shape = PlaneShape{1.0, 0.0, 0.0}, .region = {}, .paint = TexturePaint{texture}});
  SteppedClock clock;
  auto world = OpenWorld(std::make_shared<const Scene>(scene), clock);
  ASSERT_TRUE(world);
  ASSERT_TRUE(world->device.camera->Start());
  clock.Advance(std::chrono::milliseconds(100));
  const auto frame = world->device.camera->Poll();
  ASSERT_TRUE(frame && *frame && (*frame)->colour);
  const auto made = (*frame)->colour();
  const auto& colour = *made;
  const auto& luminance = *(*frame)->samples;
  ASSERT_EQ(colour.size(), 3 * luminance.size());
  for (std::size_t at = 0; at < luminance.size(); ++at) {
    double sum = 0.0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      constexpr double kWeights[] = {0.2126, 0.7152, 0.0722};
      const double light = 0.9 * texture->colour[channel][0];
      EXPECT_NEAR(colour[3 * at + channel] / 65535.0, light, 1e-4) << channel;
      sum += kWeights[channel] * colour[3 * at + channel];
    }
    EXPECT_NEAR(luminance[at], sum, 1.0);
  }
}

TEST(Colour, AMonochromeCameraHasNone) {
  Scene scene;
  scene.camera.width = scene.camera.height = 8;
  scene.surfaces.push_back({.shape = PlaneShape{1.0, 0.0, 0.0}, .region = {}, .paint = ConstantPaint{0.5}});
  SteppedClock clock;
  auto world = OpenWorld(std::make_shared<const Scene>(scene), clock);
  ASSERT_TRUE(world && world->device.camera->Start());
  clock.Advance(std::chrono::milliseconds(100));
  const auto frame = world->device.camera->Poll();
  ASSERT_TRUE(frame && *frame);
  EXPECT_FALSE((*frame)->colour);
}

}  // namespace
}  // namespace lensd::sim
