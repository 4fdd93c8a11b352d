// Rendered pictures of one scene by lens state, shared between worlds. Several threads may ask at once.
#include "sim/pictures.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <map>
#include <memory_resource>
#include <mutex>
#include <utility>
#include <variant>
#include <vector>

#include "sim/camera/lens_grid.h"
#include "sim/camera/picture_memory.h"

namespace lensd::sim {
namespace {

/// Of full scale: below the photon noise of a white pixel holding 10,000 electrons (1 %), and quick.
constexpr double kTolerance = 2.0 / 255.0;

std::vector<Picture::Bright> BrightOf(const LightImage& image) {
  std::vector<Picture::Bright> bright;
  for (std::size_t i = 0; i < image.light.size(); ++i) {
    if (image.light[i] > 1.0f) bright.push_back({static_cast<std::uint32_t>(i), image.light[i]});
  }
  return bright;
}

Picture PictureFrom(const LightImage& image, const std::vector<Picture::Bright>& bright,
                    std::pmr::memory_resource& memory) {
  Picture picture{Picture::Light(image.light.size(), &memory), {bright.begin(), bright.end(), &memory}};
  for (std::size_t i = 0; i < image.light.size(); ++i) {
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): never negative, and lround() calls a function for each.
    picture.light[i] = static_cast<std::uint16_t>(std::clamp(image.light[i], 0.0f, 1.0f) * 65535.0f + 0.5f);
  }
  return picture;
}

bool IsColoured(const Surface& surface) {
  const auto* paint = std::get_if<TexturePaint>(&surface.paint);
  return paint != nullptr && !paint->texture->colour.front().empty();
}

/// The scene as that channel sees it: coloured textures show their share of it.
Scene InLightOf(Channel channel, Scene scene) {
  if (channel == Channel::Luminance) return scene;
  for (Surface& surface : scene.surfaces) {
    if (!IsColoured(surface)) continue;
    auto& paint = std::get<TexturePaint>(surface.paint);
    const Texture& whole = *paint.texture;
    const auto share = static_cast<std::size_t>(channel) - static_cast<std::size_t>(Channel::Red);
    paint.texture = std::make_shared<const Texture>(Texture{whole.width, whole.height, whole.colour[share]});
  }
  return scene;
}

/// The scene as it is from one place of the lens centre.
struct View {
  std::vector<Renderer> renderers;  ///< of the luminance, and where colours differ of each channel
  LensGrid grid;

  static Result<std::shared_ptr<const View>> Of(const Scene& scene, bool colourful) {
    std::vector<Channel> channels{Channel::Luminance};
    if (colourful) channels.insert(channels.end(), {Channel::Red, Channel::Green, Channel::Blue});
    auto view = std::make_shared<View>(View{{}, LensGrid(scene)});
    for (const Channel channel : channels) {
      auto renderer = Renderer::Create(InLightOf(channel, scene));
      if (!renderer) return PassOn(renderer);
      view->renderers.push_back(*std::move(renderer));
    }
    return std::shared_ptr<const View>(std::move(view));
  }
};

constexpr double kPlace_m = 1e-6;       // places of the lens centre are told apart by so much
constexpr std::size_t kMostViews = 16;  // beside the first

}  // namespace

struct Pictures::Shelf {
  Shelf(std::shared_ptr<const Scene> watched, std::shared_ptr<const View> view, std::size_t budget_bytes)
      : scene(std::move(watched)),
        first(std::move(view)),
        most_bytes(budget_bytes - budget_bytes / 32),
        memory(std::make_shared<PictureMemory>(sizeof(std::uint16_t) * static_cast<std::size_t>(scene->camera.width) *
                                               static_cast<std::size_t>(scene->camera.height))) {}

  struct Key {
    LensGrid::Key lens;
    std::int64_t place = 0;  ///< of the lens centre
    std::size_t which = 0;
    auto operator<=>(const Key&) const = default;
  };
  using Entry = std::pair<Key, std::shared_ptr<const Picture>>;

  const std::shared_ptr<const Scene> scene;
  const std::shared_ptr<const View> first;  ///< with the lens centre where distances start
  const std::size_t most_bytes;             ///< in use; the rest of the budget is what pages have more
  const std::shared_ptr<PictureMemory> memory;

  std::mutex views_mutex;
  std::list<std::pair<std::int64_t, std::shared_ptr<const View>>> views;  ///< most recent first

  Result<std::shared_ptr<const View>> ViewFrom(std::int64_t place) {
    if (place == 0) return first;
    const std::lock_guard lock(views_mutex);
    const auto known = std::ranges::find(views, place, [](const auto& view) { return view.first; });
    if (known != views.end()) {
      views.splice(views.begin(), views, known);
      return known->second;
    }
    auto view = View::Of(SeenFrom(*scene, kPlace_m * static_cast<double>(place)), first->renderers.size() > 1);
    if (!view) return view;
    views.emplace_front(place, *view);
    if (views.size() > kMostViews) views.pop_back();
    return view;
  }

  std::mutex mutex;
  std::pmr::list<Entry> by_use{memory.get()};  ///< most recent first
  std::pmr::map<Key, std::pmr::list<Entry>::iterator> by_key{memory.get()};
  std::size_t bytes = 0;  ///< that all of it takes

  /// What remembering a picture takes, about: of small ones the books are a twentieth.
  std::size_t BytesOf(std::size_t light, std::size_t bright) const {
    constexpr std::size_t kBooks = sizeof(Picture) + sizeof(Entry) + sizeof(decltype(by_key)::value_type) + 128;
    return memory->BytesFor(light * sizeof(std::uint16_t)) + memory->BytesFor(bright * sizeof(Picture::Bright)) +
           kBooks;
  }
  std::size_t BytesOf(const Picture& picture) const { return BytesOf(picture.light.size(), picture.bright.size()); }

  std::shared_ptr<const Picture> Find(const Key& key) {
    const std::lock_guard lock(mutex);
    const auto found = by_key.find(key);
    if (found == by_key.end()) return nullptr;
    by_use.splice(by_use.begin(), by_use, found->second);
    return found->second->second;
  }

  /// Forgets the longest unused until so much more has room, or nothing is left. With the mutex held.
  void ForgetFor(std::size_t more_bytes) {
    while (bytes + more_bytes > most_bytes && !by_use.empty()) {
      bytes -= BytesOf(*by_use.back().second);
      by_key.erase(by_use.back().first);
      by_use.pop_back();
    }
  }

  /// Room first, then the picture: both together would take more than the budget.
  std::shared_ptr<const Picture> Keep(const Key& key, const LightImage& image) {
    const auto bright = BrightOf(image);
    const std::size_t more_bytes = BytesOf(image.light.size(), bright.size());
    {
      const std::lock_guard lock(mutex);
      ForgetFor(more_bytes);
    }
    std::shared_ptr<const Picture> picture =
        std::allocate_shared<Picture>(InPictureMemory<Picture>(memory), PictureFrom(image, bright, *memory));
    const std::lock_guard lock(mutex);
    if (const auto known = by_key.find(key); known != by_key.end())
      return known->second->second;  // another was quicker
    ForgetFor(more_bytes);
    by_use.emplace_front(key, picture);
    by_key.emplace(key, by_use.begin());
    bytes += more_bytes;
    return picture;
  }
};

Pictures::Pictures(std::unique_ptr<Shelf> shelf) : shelf_(std::move(shelf)) {}
Pictures::~Pictures() = default;

Result<std::shared_ptr<Pictures>> Pictures::Create(std::shared_ptr<const Scene> scene, std::size_t budget_bytes) {
  const bool colourful = scene->camera.colour && std::ranges::any_of(scene->surfaces, IsColoured);
  auto view = View::Of(*scene, colourful);
  if (!view) return PassOn(view);
  return std::shared_ptr<Pictures>(
      new Pictures(std::make_unique<Shelf>(std::move(scene), *std::move(view), budget_bytes)));
}

const Scene& Pictures::scene() const {
  return *shelf_->scene;
}

std::size_t Pictures::bytes() const {
  return shelf_->memory->bytes();
}

bool Pictures::colourful() const {
  return shelf_->first->renderers.size() > 1;
}

Result<std::shared_ptr<const Picture>> Pictures::At(const OpticalState& state, const std::stop_token& stop,
                                                    Channel channel) {
  const std::size_t which = colourful() ? static_cast<std::size_t>(channel) : 0;
  const std::int64_t place = std::llround(state.centre_shift_m / kPlace_m);
  const auto view = shelf_->ViewFrom(place);
  if (!view) return PassOn(view);
  const Shelf::Key key{(*view)->grid.KeyOf(state), place, which};
  if (auto known = shelf_->Find(key)) return known;
  auto rendered =
      (*view)->renderers[which].Render((*view)->grid.StateOf(key.lens), {.tolerance = kTolerance, .stop = stop});
  if (!rendered) return PassOn(rendered);
  return shelf_->Keep(key, rendered->image);
}

}  // namespace lensd::sim
