// Focus by FOCUS_RELATIVE alone: the camera only knows "nearer", "farther" and "stop". Where it is follows from how
// long it ran, in milliseconds of travel from the far end. Each run is stopped by the first reading after its time;
// what it ran too far is counted and run back.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::uvc {

/// One thread. Positions in ms of travel; 0 is the far end.
class RelativeFocus {
 public:
  struct Sent {
    Result<void> result;
    bool without_effect = false;  ///< it failed, and has certainly not been obeyed
  };
  /// Sends one FOCUS_RELATIVE: direction 1 near, -1 far, 0 stop.
  using Send = std::function<Sent(int direction)>;

  RelativeFocus(const Clock& clock, Duration travel, double resolution_ms, Send send)
      : clock_(clock), travel_(travel), resolution_ms_(resolution_ms), send_(std::move(send)) {}

  Result<void> StartHome();
  Result<void> StartMove(double target_ms);
  Result<void> Stop();
  /// Stops the motor where that is due, then tells. Errors of the stop; it is tried again at the next call.
  Result<AxisState> Read();
  bool running() const { return direction_ != 0; }

 private:
  static constexpr int kMostCorrections = 3;

  Result<void> Run(int direction, Duration how_long);
  Result<void> Halt();
  Result<void> Continue();
  double Travelled(Instant now) const;

  const Clock& clock_;
  const Duration travel_;
  const double resolution_ms_;
  const Send send_;
  double position_ms_ = 0.0;  ///< at began_, clamped to the travel
  bool homed_ = false;
  bool homing_ = false;
  int direction_ = 0;  ///< running, as far as is known
  Instant began_{};
  Instant due_{};
  std::optional<double> target_ms_;
  int corrections_ = 0;
};

}  // namespace lensd::drivers::uvc
