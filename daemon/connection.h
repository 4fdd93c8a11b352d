// One client: its bytes in, its calls in strict order, its replies out.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "event_loop.h"
#include "exchange.h"
#include "proto/frame.h"

namespace lensd::daemon {

/// What a client may make the daemon hold.
struct Limits {
  std::size_t connections = 64;
  std::size_t output_bytes = std::size_t{4} << 20;  ///< unread replies beyond this drop the client
  std::size_t busy_bytes = std::size_t{256} << 10;  ///< unread replies beyond this: its next call waits
};

/// Event loop thread only. A call whose reply is outstanding holds back the calls behind it; oneway calls do not.
class Connection {
 public:
  /// Serves one call; must not destroy the connection.
  using Dispatch = std::function<void(const ExchangePointer&)>;
  /// Told once, with the reason where it is worth a log line; destroying the connection must wait until the current
  /// event is over.
  using Closed = std::function<void(Connection&, std::string_view reason)>;

  /// Takes over the socket, which must not block. Code::Io.
  static Result<std::unique_ptr<Connection>> Create(EventLoop& loop, int socket, const Limits& limits,
                                                    Dispatch dispatch, Closed closed);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Queues one reply and writes what the socket takes.
  void Send(std::string_view message);
  /// The same for the last reply of the call in progress: the next call may begin.
  void SendLast(std::string_view message);
  /// Called when the connection closes; one for each key, an empty one forgets it.
  void AtClose(std::uint64_t key, std::move_only_function<void()> closed);

 private:
  Connection(int socket, const Limits& limits, Dispatch dispatch, Closed closed);
  static int OnSocket(sd_event_source* source, int descriptor, unsigned revents, void* self);
  static int OnTurn(sd_event_source* source, void* self);
  bool Read();
  void Serve();
  void ServeOne(std::string_view message);
  void Flush();
  bool WriteSome();
  void Watch();
  void Close(std::string_view reason);
  bool MayServe() const;

  int socket_;
  Limits limits_;
  Dispatch dispatch_;
  Closed closed_;
  EventSource source_;
  EventSource turn_;  // another round of Serve() after others had their turn
  proto::FrameReader frames_;
  ExchangePointer current_;
  std::map<std::uint64_t, std::move_only_function<void()>> at_close_;
  std::string output_;
  std::size_t written_ = 0;  // bytes of output_ that are gone already
  bool serving_ = false;     // inside Serve(): replies are flushed at its end
  bool flushing_ = false;
  bool peer_done_ = false;  // the peer will send no more
};

}  // namespace lensd::daemon
