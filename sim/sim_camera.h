// The simulated camera.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "drivers/api/camera.h"
#include "frame_grid.h"
#include "mechanics.h"
#include "sim/pictures.h"

namespace lensd::sim {

/// Renders when polled: a frame that nobody fetches costs nothing.
class SimCamera final : public drivers::Camera {
 public:
  SimCamera(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures, std::uint64_t seed);

 private:
  Result<void> DoStart() override;
  Result<void> DoStop() override;
  Result<std::optional<drivers::Frame>> DoPoll() override;
  Result<void> DoSetExposure(Duration exposure) override;

  Result<void> CheckLink() const;
  /// The newest exposure not handed out and not lost.
  std::optional<Exposure> Newest();
  /// Fills light_ with what the sensor gathers over an exposure of the nominal length.
  Result<void> Collect(Duration start, Duration length);
  Result<std::shared_ptr<const std::vector<std::uint16_t>>> Take(const Exposure& exposure);

  const std::shared_ptr<Mechanics> mechanics_;
  const std::shared_ptr<Pictures> pictures_;
  const std::uint64_t seed_;
  FrameGrid grid_;
  std::uint64_t next_sequence_ = 0;  ///< the lowest not handed out
  std::shared_ptr<const std::vector<std::uint16_t>> last_samples_;
  std::vector<float> light_;  ///< 1 is white; kept between frames, for its memory
};

}  // namespace lensd::sim
