// The simulated camera.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/api/camera.h"
#include "sim/camera/darkroom.h"
#include "sim/camera/frame_grid.h"
#include "sim/camera/frame_maker.h"
#include "sim/mechanics/mechanics.h"
#include "sim/pictures.h"

namespace lensd::sim {

/// Renders when polled: a frame that no rig fetches costs nothing. Where `aside`, on a thread of its own: the poll that
/// finds a new exposure begins with it and a later one hands it out.
class SimCamera final : public drivers::Camera {
 public:
  SimCamera(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures, std::uint64_t seed, bool aside);
  /// What is set now, for any thread; outlives the camera.
  std::shared_ptr<const std::atomic<Duration>> exposure() const { return exposure_; }

 private:
  Result<void> DoStart() override;
  Result<void> DoStop() override;
  Result<std::optional<drivers::Frame>> DoPoll() override;
  Result<void> DoSetExposure(Duration exposure) override;
  Result<void> DoSetGain(double gain_db) override;
  Result<drivers::ExposureState> DoReadExposure() override;
  drivers::Counters DoCount() const override { return counts_; }

  Result<void> CheckLink() const;
  /// The newest exposure not handed out and not lost.
  std::optional<Exposure> Newest();
  /// What the darkroom has made; Timeout where it does not come to an end.
  Result<std::optional<drivers::Frame>> Developed();
  drivers::Frame FrameOf(const Exposure& exposure, Samples samples);

  const std::shared_ptr<Mechanics> mechanics_;
  const std::shared_ptr<std::atomic<Duration>> exposure_;
  FrameMaker maker_;
  FrameGrid grid_;
  std::uint64_t next_sequence_ = 0;   ///< the lowest not handed out
  std::uint64_t next_uncounted_ = 0;  ///< of those that may be lost
  drivers::Counters counts_;
  struct Gain {
    double before_db = 0.0;
    double now_db = 0.0;
    Duration changed{};  ///< exposures that start earlier have the one before
  } gain_;
  Samples last_samples_;
  Duration submitted_{};              ///< when the darkroom got its shot
  std::optional<Darkroom> darkroom_;  ///< last: it uses maker_
};

}  // namespace lensd::sim
