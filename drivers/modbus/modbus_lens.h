// A lens whose axes are drives on one bus.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bus.h"
#include "drivers/api/lens.h"

namespace lensd::drivers::modbus {

class ModbusLens final : public drivers::Lens {
 public:
  ModbusLens(std::shared_ptr<Bus> bus, std::vector<DriveConfig> drives, const Clock& clock);
  ~ModbusLens() override;

 private:
  Result<void> DoStartHome(drivers::Axis axis) override;
  Result<void> DoStartMove(drivers::Axis axis, Native target) override;
  Result<drivers::LensState> DoRead() override;
  Result<void> DoStop(drivers::Axis axis) override;
  Result<void> DoResetFault(drivers::Axis axis) override;
  void DoInterrupt() override;
  void DoCutReadShort() override;
  std::uint64_t DoCountBusErrors() const override;

  BusSlot& SeatOf(drivers::Axis axis);

  const std::shared_ptr<Bus> bus_;
  std::vector<std::unique_ptr<BusSlot>> seats_;
  Bus::Interrupts interrupts_;
  drivers::PerAxis<bool> may_move_;  ///< told to since it was last seen to rest
};

}  // namespace lensd::drivers::modbus
