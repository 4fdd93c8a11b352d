// By how many frames the pictures of the cameras before one lens are late, as autofocus runs have shown. For any
// thread.
#pragma once

#include <mutex>
#include <optional>
#include <vector>

namespace lensd::rig {

class LearnedLag {
 public:
  /// What distinguishes one camera from another here; two with the same values share what is learned.
  struct Camera {
    bool outside = false;   ///< its frames come from a client
    double pixel_um = 0.0;  ///< configured pitch; 0: not known
    bool operator==(const Camera&) const = default;
  };
  struct Known {
    Camera camera{};
    int frames = 0;  ///< 0 and up
  };

  std::optional<int> Of(const Camera& camera) const {
    const std::lock_guard lock(mutex_);
    for (const Known& known : known_) {
      if (known.camera == camera) return known.frames;
    }
    return std::nullopt;
  }
  /// Nothing: it is in doubt.
  void Put(const Camera& camera, std::optional<int> frames) {
    constexpr std::size_t kMost = 16;
    const std::lock_guard lock(mutex_);
    std::erase_if(known_, [&](const Known& known) { return known.camera == camera; });
    if (known_.size() == kMost) known_.erase(known_.begin());
    if (frames) known_.push_back({camera, *frames});
  }
  void Forget() {
    const std::lock_guard lock(mutex_);
    known_.clear();
  }
  std::vector<Known> All() const {
    const std::lock_guard lock(mutex_);
    return known_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Known> known_;  ///< the newest last
};

}  // namespace lensd::rig
