// One open device of a driver process, and what the calls of io.lensd.Driver do with it.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string_view>
#include <utility>

#include "drivers/api/device.h"
#include "drivers/wire/wire.h"
#include "loop/descriptor.h"
#include "memory_slots.h"

namespace lensd::drivers::host {

/// Any thread. Calls of the device are made one at a time, as drivers expect. Interrupt and CutReadShort do not wait
/// for their turn, and Stop cuts a Read short until it has its own. What the driver throws comes out of these
/// functions.
class HostedDevice {
 public:
  explicit HostedDevice(Device device) : device_(std::move(device)) {}

  /// `method` without its interface, and parameters that agree with the interface. `passed`: the descriptor that came
  /// with the call.
  Result<wire::Json> Call(std::string_view method, const wire::Json& parameters, daemon::Descriptor passed);
  /// Ends calls that are under way.
  void Interrupt();
  /// Interrupts the call that is under way until it has ended, then closes, which stops what moves. Later calls answer
  /// Disconnected. A second caller waits until the first has closed it.
  void Close();
  /// For the parameters of an error.
  std::uint64_t bus_errors();

 private:
  using Handler = Result<wire::Json> (HostedDevice::*)(const wire::Json& parameters);
  static Handler HandlerOf(std::string_view method);

  Result<wire::Json> Describe(const wire::Json& parameters);
  Result<wire::Json> StartHome(const wire::Json& parameters);
  Result<wire::Json> StartMove(const wire::Json& parameters);
  Result<wire::Json> Read(const wire::Json& parameters);
  Result<wire::Json> Stop(const wire::Json& parameters);
  Result<wire::Json> ResetFault(const wire::Json& parameters);
  Result<wire::Json> StartStream(const wire::Json& parameters, daemon::Descriptor passed);
  Result<wire::Json> NextFrame(const wire::Json& parameters);
  Result<wire::Json> Colour(const wire::Json& parameters);
  Result<wire::Json> StopStream(const wire::Json& parameters);
  Result<wire::Json> SetExposure(const wire::Json& parameters);
  Result<wire::Json> SetGain(const wire::Json& parameters);
  Result<wire::Json> GetExposure(const wire::Json& parameters);
  void CutReadShort();

  Result<Lens*> TheLens() const;
  Result<Camera*> TheCamera() const;
  /// Waits for its turn, and asks whatever is under way to end until it has.
  std::unique_lock<std::timed_mutex> TurnAfter(void (HostedDevice::*ask_to_end)());
  /// Of samples: into the slot that the call names, else inline.
  Result<void> Put(const std::vector<std::uint16_t>& samples, const wire::Json& parameters, wire::Json& into);

  std::once_flag closing_;
  std::timed_mutex calls_;  ///< held during every call of the device but Interrupt() and CutReadShort()
  std::mutex open_;         ///< guards that the device is there while it is interrupted; taken after calls_
  Device device_;
  std::mutex pictures_;  ///< guards the two below: colours are made beside other calls
  MemorySlots slots_;
  std::deque<std::pair<std::uint64_t, ColourMaker>> colours_;  ///< of the newest frames
};

}  // namespace lensd::drivers::host
