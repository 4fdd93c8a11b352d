// One connection to lensd: messages out, messages and files in. Nothing here waits without a deadline unless told to.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "access.h"

namespace lensd {
inline namespace v1 {

using SteadyTime = std::chrono::steady_clock::time_point;

/// When a call has to be through.
class Deadline {
 public:
  /// From now; 0: never.
  explicit Deadline(Milliseconds timeout);
  /// For poll(2): rounded up, -1 for ever. Throws "DeadlinePassed" where none is left.
  int Left() const;
  [[noreturn]] void ThrowPassed() const;

 private:
  Milliseconds timeout_;
  std::optional<SteadyTime> end_;
};

/// One reply as it came.
struct Message {
  Json parameters = Json::object();
  std::string error{};  // "" for success
  bool continues = false;
};

/// One thread, but for Shut(). Move-only; closes what no caller took.
class Connection {
 public:
  static Connection Open(const std::string& path, const Deadline& deadline);
  Connection(Connection&& other) noexcept;
  Connection& operator=(Connection&& other) noexcept;
  ~Connection();

  void Send(const std::string& method, Json parameters, Client::Replies replies, const Deadline& deadline);
  Message Receive(const Deadline& deadline);
  /// What has come; nothing: not a whole message yet. Does not wait.
  std::optional<Message> Process();
  /// The file of the message handed out last; the caller closes it.
  int TakeFile();
  /// lensd has closed it, or said something unasked: it is of no more use.
  bool IsStale() const;
  /// Ends what another thread waits for in Receive().
  void Shut() const;
  int fd() const { return socket_; }

 private:
  explicit Connection(int socket) : socket_(socket) {}
  void WaitFor(short events, const Deadline& deadline) const;
  bool Read();
  std::optional<Message> Next();

  int socket_ = -1;
  std::string buffer_;
  std::size_t start_ = 0, scanned_ = 0;
  std::deque<int> files_;
};

/// Throws the error that a message is.
void ThrowError(const Message& message);
/// The file that an address means.
std::string SocketPath(const std::string& address);

}  // namespace v1
}  // namespace lensd
