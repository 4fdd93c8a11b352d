// HID reports in and out: the seam at which tests put a script or a simulated lens in place of /dev/hidraw.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::drivers::lensconnect {

/// One open HID device. The first byte of every report is its number. One thread calls everything but Interrupt().
class Transport {
 public:
  virtual ~Transport() = default;

  /// Sends an output report. Disconnected, Protocol.
  virtual Result<void> Write(std::span<const std::uint8_t> report) = 0;
  /// The next input report, cut to the buffer; 0: none came within `patience` (0: looks and does not wait).
  /// Disconnected; Cancelled: interrupted while waiting.
  virtual Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) = 0;
  /// Disconnected, Protocol.
  virtual Result<void> SetFeature(std::span<const std::uint8_t> report) = 0;
  /// buffer[0] names the report; its length. Disconnected, Protocol.
  virtual Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) = 0;
  /// From any thread: a Read() that waits returns Cancelled soon.
  virtual void Interrupt() = 0;
  /// Forgets an interrupt that met no Read(): a new call begins.
  virtual void BeginCall() = 0;
};

/// /dev/hidrawN through hidapi. Disconnected: no such node. Io: it may not be opened, with what to do.
Result<std::unique_ptr<Transport>> OpenHidraw(const std::string& path);

}  // namespace lensd::drivers::lensconnect
