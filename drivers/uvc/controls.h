// Requests to the controls of one video function, and what its refusals mean.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "transport.h"

namespace lensd::drivers::uvc {

struct ControlOptions {
  Duration timeout = std::chrono::seconds(1);         ///< of one transfer
  Duration interval = std::chrono::milliseconds(50);  ///< between settings: some firmwares crash on faster ones
  bool read_error_code = true;                        ///< some firmwares crash when asked why they refused
};

/// Which control: a selector of an entity (0: the interface itself) of an interface.
struct ControlAddress {
  std::uint8_t selector = 0;
  std::uint8_t entity = 0;
  std::uint8_t interface = 0;
};

/// Why the device refused, as VC_REQUEST_ERROR_CODE_CONTROL has it.
enum class Refusal : std::uint8_t {
  None = 0,
  NotReady = 1,
  WrongState = 2,
  Power = 3,
  OutOfRange = 4,
  InvalidUnit = 5,
  InvalidControl = 6,
  InvalidRequest = 7,
  InvalidValue = 8,
  Unknown = 0xFF,
};

/// One thread.
class Controls {
 public:
  /// `clock` must outlive it. `interface`: the VideoControl interface, which is asked for error codes.
  Controls(std::shared_ptr<Transport> transport, const Clock& clock, std::uint8_t interface, ControlOptions options)
      : transport_(std::move(transport)), clock_(clock), interface_(interface), options_(options) {}

  /// Exactly `length` bytes. Protocol: another length, or refused; Busy, OutOfRange, Unsupported: refused, by reason;
  /// Timeout, Cancelled, Disconnected. `what` names the control in messages.
  Result<std::vector<std::uint8_t>> Get(std::uint8_t request, ControlAddress at, std::uint16_t length,
                                        const std::string& what);
  /// As Get(), but a refusal is no error and its reason is not asked for: nullopt.
  Result<std::optional<std::vector<std::uint8_t>>> TryGet(std::uint8_t request, ControlAddress at, std::uint16_t length,
                                                          const std::string& what);
  /// Waits until `interval` after the last setting, then sets. Errors as Get(). Except after a refusal, the device may
  /// have obeyed all the same.
  Result<void> Set(ControlAddress at, std::span<const std::uint8_t> bytes, const std::string& what);

  /// The last setting failed and has certainly not been obeyed.
  bool set_without_effect() const { return set_without_effect_; }
  /// Why the last refused request was refused.
  Refusal last_refusal() const { return last_refusal_; }
  const ControlOptions& options() const { return options_; }

 private:
  Reply Run(std::uint8_t type, std::uint8_t request, ControlAddress at, std::uint16_t length,
            std::span<const std::uint8_t> out);
  Error Explain(Reply::Outcome outcome, const std::string& what);
  Refusal AskWhy();

  const std::shared_ptr<Transport> transport_;
  const Clock& clock_;
  const std::uint8_t interface_;
  const ControlOptions options_;
  std::optional<Instant> last_set_;
  bool set_without_effect_ = false;
  Refusal last_refusal_ = Refusal::None;
};

/// An error in this driver's words. Stalled is left to Controls, which can ask why.
Error ErrorOf(Reply::Outcome outcome, const std::string& what);

}  // namespace lensd::drivers::uvc
