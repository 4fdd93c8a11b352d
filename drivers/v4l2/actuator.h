// What carries out one axis' codes: a V4L2 control, or a voice coil's register.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/result.h"
#include "controls.h"
#include "kernel.h"

namespace lensd::drivers::v4l2 {

/// The codes an actuator takes.
struct CodeRange {
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::int64_t step = 1;
};

class Actuator {
 public:
  virtual ~Actuator() = default;
  virtual CodeRange range() const = 0;
  /// Read() tells where the mechanism is rather than what was written.
  virtual bool live() const { return false; }
  virtual Result<void> Write(std::int64_t code) = 0;
  /// The code it holds; none where it cannot be read. Fails where the device is gone, readable or not.
  virtual Result<std::optional<std::int64_t>> Read() = 0;
};

/// A control of an open node, which is kept open for as long as the actuator lives.
class ControlActuator final : public Actuator {
 public:
  ControlActuator(std::shared_ptr<const Node> node, Control control)
      : node_(std::move(node)), control_(std::move(control)) {}
  std::uint32_t id() const { return control_.id; }
  CodeRange range() const override { return {control_.minimum, control_.maximum, control_.step}; }
  bool live() const override { return control_.live; }
  Result<void> Write(std::int64_t code) override { return SetControl(*node_, control_, code); }
  Result<std::optional<std::int64_t>> Read() override;

 private:
  const std::shared_ptr<const Node> node_;
  const Control control_;
};

/// DW9714: 10 bits of current, written as two bytes, big-endian, the code in bits 13..4, fastest slew (S = 0). Read
/// back where the bus offers plain transfers. Disconnected: no chip answers; Busy: a kernel driver has the chip.
Result<std::unique_ptr<Actuator>> OpenDw9714(Kernel& kernel, const std::string& bus, std::uint16_t address);

}  // namespace lensd::drivers::v4l2
