// The client side of one connection to a driver process.
#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/wire/channel.h"
#include "varlink/message.h"

namespace lensd::drivers::process {

/// Replies come in the order of the calls; those to calls that were given up are passed over. One thread sends at a
/// time, and one receives.
class Link {
 public:
  explicit Link(daemon::Descriptor socket);

  /// The number of the call, from 1. `method` without its interface. `pass`: a descriptor that goes with it; -1: none.
  Result<std::uint64_t> Send(std::string_view method, varlink::Json parameters, Instant deadline, int pass = -1);
  /// The reply to call `number`. Cancelled: the descriptor `wake` became readable (-1: none). Timeout: at `deadline`.
  /// Disconnected, Io: the other side is gone. Protocol: it broke the rules, or replied to what was not asked.
  Result<varlink::Reply> Receive(std::uint64_t number, Instant deadline, int wake);
  std::uint64_t sent() const { return sent_; }
  std::uint64_t received() const { return received_; }
  /// From any thread: both sides see the end of the connection.
  void Shut();

 private:
  wire::Channel channel_;
  std::atomic<std::uint64_t> sent_ = 0;
  std::uint64_t received_ = 0;
};

}  // namespace lensd::drivers::process
