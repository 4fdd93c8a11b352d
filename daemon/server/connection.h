// One client: its bytes in, its calls in strict order, its replies out.
#pragma once

#include <sys/epoll.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "daemon/server/exchange.h"
#include "loop/event_loop.h"
#include "varlink/frame.h"

namespace lensd::daemon {

/// What clients may make the daemon hold.
struct Limits {
  std::size_t connections = 256;
  std::size_t user_connections = 64;                ///< of one user
  std::size_t administrator_connections = 16;       ///< beyond those, for administrators alone
  std::size_t stop_connections = 32;                ///< beyond those, for calls that act when they are read
  std::size_t oneway_calls = 16;                    ///< of one connection, unfinished
  std::size_t output_bytes = std::size_t{4} << 20;  ///< unread replies beyond this drop the client
  std::size_t busy_bytes = std::size_t{256} << 10;  ///< unread replies beyond this: its next call waits
};

/// Time that calls took since the loop last had time for those that wait for their turn.
struct TurnBudget {
  Duration spent{};
};

/// What a connection needs of its server; outlives it.
struct ConnectionHost {
  EventLoop& loop;
  Limits limits;
  /// Serves one call; must not destroy the connection.
  std::function<void(const ExchangePointer&)> dispatch;
  /// Whether a message is a call that acts when it is read.
  std::function<bool(std::string_view message)> acts_when_read;
  TurnBudget budget;
  std::uint64_t calls_read = 0;
};

/// Event loop thread only. A call whose reply is outstanding holds back the calls behind it; oneway calls do not, up to
/// a number. Calls that act when they are read do so at once, and their replies keep the order.
class Connection {
 public:
  /// Told once, with the reason where it is worth a log line; destroying the connection must wait until the current
  /// event is over.
  using Closed = std::function<void(Connection&, std::string_view reason)>;
  /// Only: every call but those that act when they are read is answered with this error, and the connection closed.
  struct Restriction {
    std::string error;  ///< full name; empty: none
    std::string message;
  };

  /// Which of the places that are limited in number it takes.
  enum class Seat { Shared, Administrators, Stops };

  /// Who connected, and what it may ask.
  struct Guest {
    std::shared_ptr<const Credentials> credentials;
    Seat seat = Seat::Shared;
    Restriction restriction{};
  };

  /// Takes over the socket, which must not block. Code::Io.
  static Result<std::unique_ptr<Connection>> Create(ConnectionHost& host, int socket, Guest guest, Closed closed);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Queues one reply, with an open file where there is one, and writes what the socket takes.
  void Send(std::string_view message, Descriptor file = {});
  /// The same for the last reply of the call in progress: the next call may begin.
  void SendLast(std::string_view message);
  /// Called when the connection closes; one for each key, an empty one forgets it.
  void AtClose(std::uint64_t key, std::move_only_function<void()> closed);
  /// Bytes sent that the client has not read.
  std::size_t unread() const;
  /// Which program of which user connected, for people.
  std::string caller() const;
  /// Reads what has come already.
  void Start() { OnSocket(nullptr, socket_, EPOLLIN, this); }
  void Close(std::string_view reason);
  Seat seat() const { return guest_.seat; }
  uid_t user() const { return guest_.credentials->user; }
  /// Nothing is asked, and nothing of it is left to wait for.
  bool idle() const { return !current_ && inbox_.messages.empty() && at_close_.empty(); }
  Instant last_read() const { return inbox_.last_read; }

 private:
  /// One message, read but not served.
  struct Incoming {
    std::uint64_t number = 0;
    std::string text;
    ExchangePointer early;  ///< of a call that acted when it was read
  };
  struct Inbox {
    varlink::FrameReader frames;
    std::deque<Incoming> messages;
    std::size_t bytes = 0;   ///< of them
    std::string broken;      ///< why nothing can be read after them; empty: it can
    bool peer_done = false;  ///< the peer will send no more
    bool peer_gone = false;  ///< and reads no more: what it sent without wanting a reply is still served
    Instant last_read{};
  };
  struct Output {
    /// An open file that goes with the first byte of its message.
    struct Attached {
      std::size_t at = 0;  ///< in `bytes`
      Descriptor file;
    };
    std::string bytes;
    std::size_t written = 0;  ///< of them: gone already
    std::deque<Attached> files;
    bool flushing = false;
  };
  static std::size_t SizeOf(const Incoming& message) { return sizeof message + message.text.size(); }
  Connection(ConnectionHost& host, int socket, Guest guest, Closed closed);
  static int OnSocket(sd_event_source* source, int descriptor, unsigned revents, void* self);
  static int OnTurn(sd_event_source* source, void* self);
  bool Read();
  bool HasRoom() const;
  void HangUp();
  void Sort();
  void Serve();
  void ServeOne(const Incoming& message);
  ExchangePointer Begin(varlink::ReceivedCall call, std::uint64_t number);
  void TakeTurn();
  void Flush();
  bool WriteSome();
  ssize_t WriteOnce();
  void Watch();
  bool MayServe() const;

  ConnectionHost& host_;
  int socket_;
  Guest guest_;
  Closed closed_;
  EventSource source_;
  EventSource turn_;  // another round of Serve() after others had their turn
  ExchangePointer current_;
  std::shared_ptr<std::size_t> oneway_ = std::make_shared<std::size_t>(0);  // unfinished
  std::map<std::uint64_t, std::move_only_function<void()>> at_close_;
  Inbox inbox_;
  Output output_;
  bool serving_ = false;  // inside Serve(): replies are flushed at its end
};

}  // namespace lensd::daemon
