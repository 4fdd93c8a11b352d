// The lens behind a camera terminal.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "axis_control.h"
#include "config.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"
#include "relative_focus.h"
#include "session.h"

namespace lensd::drivers::uvc {

/// Focus, iris and zoom over absolute controls; focus over relative moves where there is nothing else. The class has no
/// busy bit: an axis counts as moving until reading back shows what was set (`feedback`: or until it stands still) and,
/// where the control is asynchronous and reading back is no proof, until the status endpoint says that it is done.
class UvcLens final : public Lens {
 public:
  /// Asks every control for its range and takes focus and iris from the camera's automatics. Controls that are listed
  /// and cannot be used are left out. Null: no axis is left. Errors of the whole device.
  static Result<std::unique_ptr<Lens>> Open(std::shared_ptr<Session> session, const LensConfig& config,
                                            Findings& findings);
  ~UvcLens() override;

 private:
  struct AbsoluteAxis {
    UnitControl control;
    ControlRange range;
    double unit = 1.0;                   ///< native units in one of the control's
    std::optional<std::int64_t> target;  ///< last told
    std::int64_t current = 0;            ///< last read
    Instant changed_at{};                ///< when `current` was last seen to differ, or the last command
    bool awaiting = false;               ///< asynchronous, and its end has not been told
    bool failed = false;                 ///< the camera told that it did not get there
  };
  using Axes = PerAxis<std::optional<AbsoluteAxis>>;

  UvcLens(Capabilities capabilities, std::shared_ptr<Session> session, const LensConfig& config, const Axes& axes);

  Result<void> DoStartHome(Axis axis) override;
  Result<void> DoStartMove(Axis axis, Native target) override;
  Result<LensState> DoRead() override;
  void Halt();
  Result<void> DoStop(Axis axis) override;
  void DoInterrupt() override { session_->transport().Interrupt(); }

  static Result<AbsoluteAxis> AskAxis(Session& session, Axis axis, const LensConfig& config);
  static Result<Axes> FindAxes(Session& session, const LensConfig& config, Findings& findings);
  Result<void> SetTo(Axis axis, std::int64_t value);
  Result<void> SetOnce(Axis axis, const AbsoluteAxis& absolute, std::int64_t value);
  Result<AxisState> ReadAxis(Axis axis, AbsoluteAxis& absolute);
  Result<std::int64_t> ReadCurrent(Axis axis, const AbsoluteAxis& absolute);
  void TakeEvents();

  const std::shared_ptr<Session> session_;
  const LensConfig config_;
  Axes axes_;
  std::optional<RelativeFocus> relative_;
};

}  // namespace lensd::drivers::uvc
