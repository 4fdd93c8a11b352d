// The openings are those of the lessons, computed by optics/; the light comes from sim/, which shares no formula with
// it.
#include "bench/gallery/frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/quantity_text.h"
#include "bench/gallery/lessons.h"
#include "optics/conjugates.h"
#include "optics/light.h"
#include "optics/thin_lens.h"
#include "sim/render.h"

namespace lensd::bench {
namespace {

constexpr int kWidth = 444;  // px: a picture of at most 150 KiB

/// What is set for one frame.
struct Setting {
  std::string name;
  std::string what;
  sim::LensModel model;
  Metres diameter;
};

/// One photograph with its depths before a camera of fewer, larger pixels.
Result<sim::Scene> SmallScene(const std::string& path) {
  auto scene = sim::LoadScene(path);
  if (!scene) return scene;
  const double factor = static_cast<double>(kWidth) / scene->camera.width;
  scene->camera.pixel_um /= factor;
  scene->camera.height = static_cast<int>(std::lround(scene->camera.height * factor));
  scene->camera.width = kWidth;
  return scene;
}

io::Image ImageOf(const sim::LightImage& light) {
  io::Image image{.width = light.width, .height = light.height, .samples = {}};
  image.samples.reserve(light.light.size());
  for (const float value : light.light)
    image.samples.push_back(static_cast<std::uint16_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f))));
  return image;
}

/// Of light on the axis, beside an opening `widest` wide before the same sensor.
double Exposure(Metres diameter, Metres widest, Metres sensor) {
  return optics::thin_lens::ExactLight(sensor / widest) / optics::thin_lens::ExactLight(sensor / diameter);
}

Result<GalleryFrame> Rendered(const sim::Renderer& renderer, const sim::OpticalState& state, std::string name,
                              std::string says, const sim::RenderOptions& options = {}) {
  const auto rendered = renderer.Render(state, options);
  if (!rendered) return PassOn(rendered);
  return GalleryFrame{std::move(name), std::move(says), ImageOf(rendered->image)};
}

Result<void> AddOpenings(const std::string& scenes, std::vector<GalleryFrame>& frames) {
  constexpr Metres kFocalLength{0.05};
  constexpr FNumber kWide{1.4}, kNarrow{16.0};
  constexpr Dioptres kFocus{1.0 / 2.39};  // the engine of the motorcycle
  const auto scene = SmallScene(scenes + "/motorcycle.toml");
  if (!scene) return PassOn(scene);
  const auto renderer = sim::Renderer::Create(*scene);
  if (!renderer) return PassOn(renderer);
  const Metres sensor = kFocalLength + optics::Extension(kFocalLength, kFocus);
  const Metres wide = optics::ApertureDiameter(kFocalLength, kWide);
  const Metres narrow = optics::ApertureDiameter(kFocalLength, kNarrow);
  for (const Setting& set :
       {Setting{"small-pinhole", "pinhole, as wide as is sharpest", sim::LensModel::Aperture,
                Sharpest(sensor, kFocus).diameter},
        Setting{"wide-hole", "hole without a lens", sim::LensModel::Aperture, narrow},
        Setting{"lens-wide-open", "lens wide open, f/" + Short(kWide.value), sim::LensModel::Thin, wide},
        Setting{"lens-stopped-down", "lens stopped down, f/" + Short(kNarrow.value), sim::LensModel::Thin, narrow}}) {
    const double longer = Exposure(set.diameter, wide, sensor);
    std::string says = set.what + ": opening " + LengthText(set.diameter, 3);
    if (longer > 1.0) says += ", exposed " + Short(longer, 3) + " times as long as the lens wide open";
    auto frame = Rendered(*renderer, {set.model, kFocalLength.value, set.diameter.value, sensor.value}, set.name, says);
    if (!frame) return PassOn(frame);
    frames.push_back(*std::move(frame));
  }
  return {};
}

Result<void> AddTiltedPlane(const std::string& scenes, std::vector<GalleryFrame>& frames) {
  constexpr TiltedPlane plane;
  auto scene = sim::LoadScene(scenes + "/regimes/tilted.toml");
  if (!scene) return PassOn(scene);
  scene->surfaces.front().shape = sim::PlaneShape{plane.u0.value, plane.ux.value, 0.0};
  const auto renderer = sim::Renderer::Create(*scene);
  if (!renderer) return PassOn(renderer);
  const Metres sensor = plane.focal_length + optics::Extension(plane.focal_length, plane.focus);
  const Metres diameter = optics::ApertureDiameter(plane.focal_length, plane.f_number);
  const int height = scene->camera.height / 4;
  auto frame =
      Rendered(*renderer, {sim::LensModel::Thin, plane.focal_length.value, diameter.value, sensor.value},
               "tilted-plane", "tilted plane at f/" + Short(plane.f_number.value) + ": sharp where its V is 0",
               {.region = sim::PixelRect{0, (scene->camera.height - height) / 2, scene->camera.width, height}});
  if (!frame) return PassOn(frame);
  frames.push_back(*std::move(frame));
  return {};
}

}  // namespace

Result<std::vector<GalleryFrame>> Frames(const std::string& scenes) {
  std::vector<GalleryFrame> frames;
  if (const auto added = AddOpenings(scenes, frames); !added) return PassOn(added);
  if (const auto added = AddTiltedPlane(scenes, frames); !added) return PassOn(added);
  return frames;
}

}  // namespace lensd::bench
