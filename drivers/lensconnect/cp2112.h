// The CP2112 HID-to-SMBus bridge inside the lens (SiLabs AN495 and errata 0.4): plain writes and reads, each with an
// end and a finite number of attempts.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/clock.h"
#include "base/result.h"
#include "transport.h"

namespace lensd::drivers::lensconnect {

/// Uses output reports 0x10, 0x12, 0x14, 0x15, 0x17 and feature report 0x06, nothing else: 0x01 resets the chip and
/// 0x20 to 0x24 burn its one-time-programmable area. One thread.
class Cp2112 {
 public:
  /// `clock` must outlive the bridge.
  Cp2112(std::unique_ptr<Transport> transport, const Clock& clock);

  /// Throws away what is left over from others (erratum E111), sets the bus and checks that it took. Call first.
  /// Disconnected, Timeout, Protocol.
  Result<void> Configure();

  /// Every transfer ends by `deadline`.
  void SetDeadline(Instant deadline) { deadline_ = deadline; }

  /// One SMBus write of 1 to 61 bytes to a 7-bit address. Timeout: not acknowledged, or no reply from the bridge; it
  /// may or may not have been carried out. Busy: the bus is not free. Protocol. Disconnected. Cancelled.
  Result<void> Write(std::uint8_t address, std::span<const std::uint8_t> data);
  /// One SMBus read of 1 to 61 bytes. Errors as Write().
  Result<void> Read(std::uint8_t address, std::span<std::uint8_t> data);
  /// After a transfer that failed: abandons it and waits until no late reply can come any more.
  Result<void> Recover();

  Transport& transport() { return *transport_; }

 private:
  struct Status;

  Result<void> Output(std::span<const std::uint8_t> report);
  Result<void> Drain(Duration quiet);
  Result<std::span<const std::uint8_t>> Await(std::uint8_t id, Duration patience);
  Result<Status> AskStatus();
  Result<void> AwaitTransfer();
  Result<void> Collect(std::span<std::uint8_t> data);
  Duration Left() const { return deadline_ - clock_.Now(); }

  std::unique_ptr<Transport> transport_;
  const Clock& clock_;
  Instant deadline_ = Instant::max();
  std::uint8_t buffer_[64] = {};
  int answers_ = 0;  ///< thrown away
};

}  // namespace lensd::drivers::lensconnect
