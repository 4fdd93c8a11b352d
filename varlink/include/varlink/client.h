// A blocking Varlink client over a Unix socket. Nothing here waits without a deadline unless asked to.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "base/result.h"
#include "varlink/frame.h"
#include "varlink/message.h"

namespace lensd::varlink {

/// One connection. Move-only; one thread.
class Client {
 public:
  /// Connects. Code::Disconnected: no such socket, or no service listens there. PermissionDenied by the file system is
  /// Code::Disconnected too, with that reason in the message. Code::InvalidArgument: a path too long for a socket.
  static Result<Client> Connect(const std::string& path);
  Client(Client&& other) noexcept;
  Client& operator=(Client&& other) noexcept;
  ~Client();

  /// `Send` and `Receive` give up at this time; none: wait for ever.
  void SetDeadline(std::optional<Instant> deadline) { deadline_ = deadline; }
  /// `Receive` ends with Code::Cancelled as soon as this descriptor is readable (a signalfd); -1: none.
  void SetInterrupt(int descriptor) { interrupt_ = descriptor; }

  /// Queues one call to the daemon. Code::Timeout, Code::Io.
  Result<void> Send(const Call& call);
  /// The next reply to the newest call; those to calls before it, given up on a deadline, are passed over. An error the
  /// service answered with is a Reply too. Code::Timeout, Code::Disconnected (the service
  /// closed), Code::Io, Code::Protocol, Code::Cancelled.
  Result<Reply> Receive();
  /// Send and one Receive.
  Result<Reply> Invoke(std::string_view method, Json parameters = Json::object());

 private:
  explicit Client(int socket) : socket_(socket) {}
  Result<void> WaitFor(short events);

  int socket_ = -1;
  int interrupt_ = -1;
  std::optional<Instant> deadline_;
  FrameReader frames_{kMaxReplyBytes};
  int unanswered_ = 0;  ///< calls whose last reply has not come
  int given_up_ = 0;    ///< of these, the ones made before the newest
};

}  // namespace lensd::varlink
