// By how many frames the pictures of the cameras before one lens are late, as autofocus runs have shown.
#pragma once

#include <optional>
#include <vector>

namespace lensd::rig {

class LearnedLag {
 public:
  /// Two cameras that agree in both are taken for one.
  struct Camera {
    bool outside = false;   ///< its frames come from a client
    double pixel_um = 0.0;  ///< configured pixel pitch; 0: not known
    bool operator==(const Camera&) const = default;
  };

  /// Frames, 0 and up; nothing: not known.
  std::optional<int> Of(const Camera& camera) const {
    for (const Known& known : known_) {
      if (known.camera == camera) return known.frames;
    }
    return std::nullopt;
  }
  /// Nothing: it is in doubt.
  void Put(const Camera& camera, std::optional<int> frames) {
    constexpr std::size_t kMost = 16;
    std::erase_if(known_, [&](const Known& known) { return known.camera == camera; });
    if (known_.size() == kMost) known_.erase(known_.begin());
    if (frames) known_.push_back({camera, *frames});
  }

 private:
  struct Known {
    Camera camera{};
    int frames = 0;
  };
  std::vector<Known> known_;  ///< the newest last
};

}  // namespace lensd::rig
