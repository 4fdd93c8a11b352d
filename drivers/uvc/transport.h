// The seam between what the driver says and how it gets there: libusb in the product, a script or a simulated camera in
// the tests.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "wire.h"

namespace lensd::drivers::uvc {

/// What became of one control transfer.
struct Reply {
  enum class Outcome {
    Done,
    Stalled,    ///< the device refused
    TimedOut,   ///< no answer; it may have been obeyed
    Cancelled,  ///< by Interrupt(); it may have been obeyed
    NotSent,    ///< by Interrupt(), before it was sent
    Gone,       ///< the device is not there any more
    Failed,     ///< anything else; it may have been obeyed
  };
  Outcome outcome = Outcome::Done;
  std::vector<std::uint8_t> data;  ///< of an IN transfer
};

/// Where a camera's pictures come from.
struct StreamPipe {
  std::uint8_t interface = 0;
  std::uint8_t alternate = 0;  ///< setting to stream with; 0 for bulk
  std::uint8_t endpoint = 0;   ///< address
  bool isochronous = false;
  std::uint32_t transfer_bytes = 0;  ///< of a packet (isochronous) or of a whole payload (bulk)
};

/// Takes what a stream brings, on the transport's own thread.
class PayloadSink {
 public:
  virtual ~PayloadSink() = default;
  /// One payload with its header.
  virtual void OnPayload(std::span<const std::uint8_t> payload) = 0;
  /// A packet was damaged on its way.
  virtual void OnLoss() = 0;
};

/// An open device with its interfaces claimed. One thread calls everything but Interrupt().
class Transport {
 public:
  virtual ~Transport() = default;
  /// Runs one control transfer and waits for its end, `timeout` at the longest. `out` is empty for IN transfers.
  virtual Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) = 0;
  /// Lets time pass, until `until` or Interrupt().
  virtual void WaitUntil(Instant until) = 0;
  /// Packets of the status endpoint since the last call, oldest first. Empty where there is no such endpoint.
  virtual std::vector<std::vector<std::uint8_t>> TakeStatus() = 0;
  /// Begins streaming into `sink`, which must live until StopStream() returns. Busy, Disconnected, Protocol.
  virtual Result<void> StartStream(const StreamPipe& pipe, PayloadSink& sink) = 0;
  /// After this the sink is not called any more. Harmless when nothing streams.
  virtual void StopStream() = 0;
  /// The device has been unplugged; stays true.
  virtual bool Gone() const = 0;
  /// Throws what was thrown on the transport's own thread.
  virtual void CheckThread() const {}
  /// A public call of a lens or a camera begins: Interrupt() before this does not touch it.
  virtual void BeginCall() = 0;
  /// From any thread: ends the transfer or the wait under way, and all others of this call.
  virtual void Interrupt() = 0;
};

}  // namespace lensd::drivers::uvc
