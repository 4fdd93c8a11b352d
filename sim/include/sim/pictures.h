// Pictures of one scene by lens state: rendered once, used by every world that looks at the scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "sim/render.h"
#include "sim/scene.h"

namespace lensd::sim {

/// Light on the sensor, row-major, width * height of the scene's camera; 1 is white at the initial f-number. Kept in
/// 16 bits, to 1/131070 of white.
struct Picture {
  struct Bright {
    std::uint32_t index;
    float light;  ///< > 1
  };
  using Light = std::pmr::vector<std::uint16_t>;
  using Brights = std::pmr::vector<Bright>;
  Light light;     ///< in 1/65535
  Brights bright;  ///< what is brighter than white; 65535 there
};

/// What part of the light a picture is made of: luminance for a camera without colour.
enum class Channel { Luminance, Red, Green, Blue };

/// Renders and remembers. Lens states are rounded before rendering so that runs which pass the same place share a
/// picture: blur moves by at most 1/128 px or 1/256 of itself, whichever is larger. Noise is never part of a picture.
/// All calls from any thread.
class Pictures {
 public:
  /// `budget_bytes` bounds what is remembered, though one picture always is; the longest unused goes first.
  /// InvalidArgument: as Renderer::Create().
  static Result<std::shared_ptr<Pictures>> Create(std::shared_ptr<const Scene> scene,
                                                  std::size_t budget_bytes = std::size_t{512} << 20);
  ~Pictures();

  const Scene& scene() const;
  /// Memory of what is remembered now, in pages of its own.
  std::size_t bytes() const;
  /// Whether red, green and blue differ: else their pictures are that of the luminance.
  bool colourful() const;
  /// Errors as Renderer::Render().
  Result<std::shared_ptr<const Picture>> At(const OpticalState& state, const std::stop_token& stop = {},
                                            Channel channel = Channel::Luminance);

 private:
  struct Shelf;
  explicit Pictures(std::unique_ptr<Shelf> shelf);
  std::unique_ptr<Shelf> shelf_;
};

}  // namespace lensd::sim
