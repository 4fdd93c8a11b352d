#include "sim/pictures.h"

#include <algorithm>
#include <list>
#include <map>
#include <mutex>
#include <utility>

#include "lens_grid.h"

namespace lensd::sim {
namespace {

/// Of full scale: below the photon noise of a white pixel holding 10,000 electrons (1 %), and quick.
constexpr double kTolerance = 2.0 / 255.0;

Picture PictureFrom(const LightImage& image) {
  Picture picture;
  picture.light.resize(image.light.size());
  for (std::size_t i = 0; i < image.light.size(); ++i) {
    const float light = image.light[i];
    if (light > 1.0f) picture.bright.push_back({static_cast<std::uint32_t>(i), light});
    picture.light[i] = static_cast<std::uint16_t>(std::clamp(light, 0.0f, 1.0f) * 65535.0f + 0.5f);
  }
  return picture;
}

}  // namespace

struct Pictures::Shelf {
  Shelf(std::shared_ptr<const Scene> watched, Renderer made, std::size_t room)
      : scene(std::move(watched)), renderer(std::move(made)), grid(*scene), most(room) {}

  using Entry = std::pair<LensGrid::Key, std::shared_ptr<const Picture>>;

  const std::shared_ptr<const Scene> scene;
  const Renderer renderer;
  const LensGrid grid;
  const std::size_t most;  ///< pictures

  std::mutex mutex;
  std::list<Entry> by_use;  ///< most recent first
  std::map<LensGrid::Key, std::list<Entry>::iterator> by_key;

  std::shared_ptr<const Picture> Find(const LensGrid::Key& key) {
    const std::lock_guard lock(mutex);
    const auto found = by_key.find(key);
    if (found == by_key.end()) return nullptr;
    by_use.splice(by_use.begin(), by_use, found->second);
    return found->second->second;
  }

  void Keep(const LensGrid::Key& key, const std::shared_ptr<const Picture>& picture) {
    const std::lock_guard lock(mutex);
    if (by_key.contains(key)) return;  // another thread was quicker
    by_use.emplace_front(key, picture);
    by_key.emplace(key, by_use.begin());
    if (by_use.size() <= most) return;
    by_key.erase(by_use.back().first);
    by_use.pop_back();
  }
};

Pictures::Pictures(std::unique_ptr<Shelf> shelf) : shelf_(std::move(shelf)) {}
Pictures::~Pictures() = default;

Result<std::shared_ptr<Pictures>> Pictures::Create(std::shared_ptr<const Scene> scene, std::size_t budget_bytes) {
  auto renderer = Renderer::Create(*scene);
  if (!renderer) return PassOn(std::move(renderer));
  const std::size_t picture_bytes =
      2 * static_cast<std::size_t>(scene->camera.width) * static_cast<std::size_t>(scene->camera.height);
  const std::size_t most = std::max<std::size_t>(1, budget_bytes / picture_bytes);
  return std::shared_ptr<Pictures>(new Pictures(std::make_unique<Shelf>(std::move(scene), std::move(*renderer), most)));
}

const Scene& Pictures::scene() const {
  return *shelf_->scene;
}

Result<std::shared_ptr<const Picture>> Pictures::At(const OpticalState& state, const std::stop_token& stop) {
  const LensGrid::Key key = shelf_->grid.KeyOf(state);
  if (auto known = shelf_->Find(key)) return known;
  auto rendered = shelf_->renderer.Render(shelf_->grid.StateOf(key), {.tolerance = kTolerance, .stop = stop});
  if (!rendered) return PassOn(std::move(rendered));
  auto picture = std::make_shared<const Picture>(PictureFrom(rendered->image));
  shelf_->Keep(key, picture);
  return picture;
}

}  // namespace lensd::sim
