// The scene's PNG files as linear light and as depth in metres.
#include "sim/scene/scene_images.h"

#include <algorithm>
#include <array>
#include <utility>

#include "io/png.h"
#include "sim/camera/sensor.h"

namespace lensd::sim {

Result<std::shared_ptr<const Texture>> LoadTexture(const std::string& path) {
  auto image = io::ReadPng(path);
  if (!image) return PassOn(image);
  const double full_scale = image->bits == 16 ? 65535.0 : 255.0;
  auto texture = std::make_shared<Texture>(Texture{image->width, image->height, {}});
  texture->light.resize(static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height));
  const auto* sample = image->samples.data();
  for (float& light : texture->light) {
    const double value =
        image->channels == 3 ? 0.2126 * sample[0] + 0.7152 * sample[1] + 0.0722 * sample[2] : 1.0 * sample[0];
    light = static_cast<float>(value / full_scale);
    for (int channel = 0; image->channels == 3 && channel < 3; ++channel) {
      texture->colour[channel].push_back(static_cast<float>(sample[channel] / full_scale));
    }
    sample += image->channels;
  }
  return texture;
}

Result<std::shared_ptr<const DepthMap>> LoadDepthMap(const std::string& path) {
  auto image = io::ReadPng(path);
  if (!image) return PassOn(image);
  if (image->channels != 1 || image->bits != 16) {
    return Fail(Code::BadData, path + ": a depth map is a 16-bit grey PNG in millimetres");
  }
  const std::uint16_t farthest_mm = *std::max_element(image->samples.begin(), image->samples.end());
  if (farthest_mm == 0) return Fail(Code::BadData, path + ": every depth is unknown (0)");
  auto depth = std::make_shared<DepthMap>(DepthMap{image->width, image->height, {}});
  depth->depth_m.reserve(image->samples.size());
  for (const std::uint16_t known_mm : image->samples) {
    depth->depth_m.push_back(static_cast<float>((known_mm == 0 ? farthest_mm : known_mm) / 1000.0));
  }
  return depth;
}

Result<PreparedFrame> LoadPreparedFrame(const std::string& path, const CameraSettings& camera) {
  auto image = io::ReadPng(path);
  if (!image) return PassOn(image);
  const int channels = camera.colour ? 3 : 1;
  const int bits = camera.bits == 8 ? 8 : 16;
  if (image->width != camera.width || image->height != camera.height || image->channels != channels ||
      image->bits != bits) {
    return Fail(Code::BadData, path + ": this camera's frames are " + std::to_string(camera.width) + " x " +
                                   std::to_string(camera.height) + " px, " + (camera.colour ? "colour" : "grey") +
                                   ", in PNGs of " + std::to_string(bits) + " bits");
  }
  if (std::ranges::max(image->samples) >> camera.bits != 0) {
    return Fail(Code::BadData, path + ": a sample has more than the camera's " + std::to_string(camera.bits) + " bits");
  }
  using Values = std::vector<std::uint16_t>;
  auto samples = std::make_shared<const Values>(std::move(image->samples));
  if (!camera.colour) return PreparedFrame{std::move(samples), nullptr};
  std::array<Values, 3> parts;
  for (std::size_t i = 0; i < samples->size(); ++i) parts[i % 3].push_back((*samples)[i]);
  return PreparedFrame{std::make_shared<const Values>(LuminanceOf(camera, parts)), std::move(samples)};
}

}  // namespace lensd::sim
