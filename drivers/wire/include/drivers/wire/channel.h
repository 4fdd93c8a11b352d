// One connected Unix socket of io.lensd.Driver: messages, and the descriptors that come with them.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "loop/descriptor.h"
#include "varlink/frame.h"

namespace lensd::drivers::wire {

/// One thread sends and one receives; both may be one.
class Channel {
 public:
  /// Of messages of at most `longest` bytes.
  Channel(daemon::Descriptor socket, std::size_t longest) : socket_(std::move(socket)), frames_(longest) {}

  int descriptor() const { return socket_.get(); }
  /// Sends a message with its NUL, and a descriptor beside it where `pass` is not -1. Timeout: not all of it is sent by
  /// `deadline`, and the connection is of no further use. Disconnected: the other side is gone. Io.
  Result<void> Send(std::string_view message, Instant deadline, int pass = -1);
  enum class Wait { No, Yes };
  /// Reads what has come. Disconnected: the other side has closed. Io.
  Result<void> Receive(Wait wait);
  /// The next whole message without its NUL, valid until Receive(). Protocol: longer than it may be.
  Result<std::optional<std::string_view>> Next() { return frames_.Next(); }
  /// The oldest descriptor that came and was not taken; empty where there is none.
  daemon::Descriptor TakeDescriptor();

 private:
  daemon::Descriptor socket_;
  varlink::FrameReader frames_;
  std::vector<daemon::Descriptor> came_;
};

}  // namespace lensd::drivers::wire
