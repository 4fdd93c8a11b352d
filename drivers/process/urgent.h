// The connection to a driver process by which a call that is under way on another one is ended.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "link.h"
#include "loop/descriptor.h"

namespace lensd::drivers::process {

/// Knows which call of a device is under way, so that a request to end it reaches no other call. Begin(), End() and the
/// calls by this connection itself are of one thread at a time; Interrupt() and CutReadShort() of any.
class Urgent {
 public:
  Urgent(std::unique_ptr<Link> link, std::string device);

  /// Before a call by another connection: what was sent to end the call before has been carried out, so that it does
  /// not end this one. Errors of Link::Receive().
  Result<void> Settle(Instant deadline);
  void Begin(bool reading);
  void End();
  /// Readable: the call under way is to end.
  int wake() const { return wake_.get(); }
  /// The call under way was interrupted, not merely cut short.
  bool interrupted();

  /// A call by this connection, as Link has it.
  Result<std::uint64_t> Send(std::string_view method, varlink::Json parameters, Instant deadline);
  Link& link() { return *link_; }

  /// The call under way ends soon. Harmless when none is.
  void Interrupt();
  /// Ends the wait of a call of Read, and of no other call.
  void CutReadShort();

 private:
  struct UnderWay {
    bool reading = false;
    bool interrupted = false;
    bool cut_short = false;
  };
  void Urge(std::string_view method);

  const std::unique_ptr<Link> link_;
  const std::string device_;  ///< how the process calls it
  const daemon::Descriptor wake_;
  std::mutex mutex_;  ///< guards the next, and who sends
  std::optional<UnderWay> under_way_;
};

}  // namespace lensd::drivers::process
