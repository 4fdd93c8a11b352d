// When frames are exposed: on a fixed grid of the world's time, a longer exposure taking several cells of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/clock.h"

namespace lensd::sim {

/// One exposure, in the world's time.
struct Exposure {
  Duration start{};
  Duration length{};
  std::uint64_t sequence = 0;
};

/// The exposures of one camera. Calls come in order of time. Not thread-safe.
class FrameGrid {
 public:
  FrameGrid(double frame_rate_hz, Duration exposure);

  bool streaming() const { return streaming_; }
  void Start(Duration now);
  void Stop(Duration now);
  void SetExposure(Duration now, Duration exposure);
  Duration exposure() const { return exposure_; }  ///< of frames from now on

  /// The newest exposure of this stream that is over by `now`. Sequence numbers go on across pauses.
  std::optional<Exposure> NewestDone(Duration now) const;
  /// The exposure of this stream with that number.
  std::optional<Exposure> Numbered(std::uint64_t sequence) const;

 private:
  /// Exposures of one length, back to back, from cell `first` on.
  struct Run {
    std::int64_t first = 0;
    std::int64_t cells = 1;  ///< from one start to the next
    Duration length{};
    std::uint64_t sequence = 0;  ///< of the one at `first`
    std::int64_t frames = 0;     ///< how many
  };
  /// Ends the last run: an exposure under way at `now` is its last.
  void End(Duration now);
  std::int64_t CellFrom(Duration now) const;  ///< the first that starts at `now` or later
  Exposure Nth(const Run& run, std::int64_t n) const;

  Duration period_;
  Duration exposure_;
  bool streaming_ = false;
  std::uint64_t next_sequence_ = 0;  ///< of the next run
  std::int64_t next_cell_ = 0;       ///< before which no run starts
  std::vector<Run> runs_;
};

}  // namespace lensd::sim
