// One world as a bench: drivers::Simulation over its mechanics.
#pragma once

#include <atomic>
#include <memory>

#include "drivers/api/simulation.h"
#include "sim/camera/frame_maker.h"
#include "sim/mechanics/mechanics.h"
#include "sim/pictures.h"

namespace lensd::sim {

class Bench final : public drivers::Simulation {
 public:
  /// `exposure`: the camera's, as it is set.
  Bench(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures,
        std::shared_ptr<const std::atomic<Duration>> exposure);

  Result<drivers::SimulatedTruth> TruthAt(std::optional<Instant> at, std::optional<double> vergence_d) override;
  Result<void> Inject(const drivers::SimulatedFault& fault) override;
  Result<drivers::Frame> Render(const std::stop_token& stop) override;

 private:
  const std::shared_ptr<Mechanics> mechanics_;
  const std::shared_ptr<const std::atomic<Duration>> exposure_;
  const std::shared_ptr<Pictures> pictures_;
  FrameMaker maker_;
};

}  // namespace lensd::sim
