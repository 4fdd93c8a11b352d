// The simulated lens: the controller's side of the mechanics, with what the link does to its answers.
#pragma once

#include <memory>
#include <optional>

#include "drivers/api/lens.h"
#include "sim/mechanics/mechanics.h"

namespace lensd::sim {

class SimLens final : public drivers::Lens {
 public:
  explicit SimLens(std::shared_ptr<Mechanics> mechanics);
  ~SimLens() override;

 private:
  Result<void> DoStartHome(drivers::Axis axis) override;
  Result<void> DoStartMove(drivers::Axis axis, Native target) override;
  Result<drivers::LensState> DoRead() override;
  Result<void> DoStop(drivers::Axis axis) override;

  Result<void> CheckLink() const;
  /// The acknowledgement of a command the device has obeyed.
  Result<void> Acknowledge() const;

  const std::shared_ptr<Mechanics> mechanics_;
  std::optional<drivers::LensState> late_;  ///< an answer still under way
};

}  // namespace lensd::sim
