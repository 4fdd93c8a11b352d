// A lens that takes codes and says little.
//
// A V4L2 control or a voice coil has no busy bit and, nearly always, no position: writing a code is all there is. The
// rest is bookkeeping. A move is one write, or, where a speed is given, a row of writes along a straight ramp, so that
// a coil does not click and can be stopped midway; each Read() writes the code that is due. Where the code can be read
// back it is: what differs was clamped or moved by another program. A device that reads back its true place, or takes
// its time to show the code, counts as moving until the number stands still.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "actuator.h"
#include "config.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::v4l2 {

/// One axis of a lens to be.
struct AxisParts {
  drivers::Axis axis = drivers::Axis::Focus;
  std::unique_ptr<Actuator> actuator;
  AxisConfig config;
  std::optional<drivers::KnownDirection> direction{};  ///< of focus
  /// Takes the axis from the device's own automatism again, which another program has switched on; null: there is none.
  std::function<Result<void>()> take{};
};

/// Something that happened to an axis without us.
struct Change {
  drivers::Axis axis = drivers::Axis::Focus;
  std::optional<std::int64_t> code;  ///< another program has set it
  std::string notice;                ///< what is wrong until the next move; empty: nothing
};

/// What a node tells of such changes; none for a voice coil on a bus.
class Changes {
 public:
  virtual ~Changes() = default;
  virtual std::vector<Change> Take() = 0;
};

class CodeLens final : public drivers::Lens {
 public:
  /// `held` is destroyed after the last write, as is `changes`: automatics to set back, nodes to close. Reads every
  /// axis; one that cannot be read is left out. Null: none is left. Errors of the whole device.
  static Result<std::unique_ptr<drivers::Lens>> Make(drivers::Capabilities who, std::vector<AxisParts> axes,
                                                     std::shared_ptr<void> held, std::unique_ptr<Changes> changes,
                                                     drivers::Findings& findings, const Clock& clock);
  ~CodeLens() override = default;

 private:
  struct AxisRun;

  CodeLens(drivers::Capabilities can, std::vector<AxisRun> axes, std::shared_ptr<void> held,
           std::unique_ptr<Changes> changes, const Clock& clock);
  Result<void> DoStartHome(drivers::Axis axis) override;
  Result<void> DoStartMove(drivers::Axis axis, Native target) override;
  Result<drivers::LensState> DoRead() override;
  Result<void> DoStop(drivers::Axis axis) override;

  AxisRun& RunOf(drivers::Axis axis);
  void TakeChanges();

  const std::shared_ptr<void> held_;  // destroyed last
  const std::unique_ptr<Changes> changes_;
  std::vector<AxisRun> axes_;
  const Clock& clock_;
};

}  // namespace lensd::drivers::v4l2
