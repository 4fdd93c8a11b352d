#include "connection.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace lensd::daemon {
namespace {

/// Calls served in one turn of the loop, so that one busy client cannot starve the others.
constexpr int kCallsPerTurn = 32;

}  // namespace

Result<std::unique_ptr<Connection>> Connection::Create(EventLoop& loop, int socket, const Limits& limits,
                                                       Dispatch dispatch, Closed closed) {
  std::unique_ptr<Connection> made(new Connection(socket, limits, std::move(dispatch), std::move(closed)));
  sd_event_source* source = nullptr;
  sd_event_source* turn = nullptr;
  int status = sd_event_add_io(loop.get(), &source, socket, EPOLLIN, OnSocket, made.get());
  made->source_.reset(source);
  if (status >= 0) status = sd_event_add_defer(loop.get(), &turn, OnTurn, made.get());
  made->turn_.reset(turn);
  if (status < 0) return Fail(Code::Io, std::string("cannot watch a connection: ") + std::strerror(-status));
  sd_event_source_set_enabled(turn, SD_EVENT_OFF);
  return made;
}

Connection::Connection(int socket, const Limits& limits, Dispatch dispatch, Closed closed)
    : socket_(socket), limits_(limits), dispatch_(std::move(dispatch)), closed_(std::move(closed)) {}

Connection::~Connection() {
  if (current_) current_->connection_ = nullptr;
  if (socket_ >= 0) close(socket_);
}

int Connection::OnSocket(sd_event_source*, int, unsigned revents, void* self) {
  auto& connection = *static_cast<Connection*>(self);
  if (revents & EPOLLIN) {
    // What a peer sent before it went still counts: a last oneway call is carried out.
    if (!connection.Read()) return 0;
    connection.Serve();
  }
  if (connection.socket_ >= 0 && (revents & EPOLLOUT)) {
    connection.Flush();
    connection.Serve();
  }
  if (connection.socket_ >= 0 && (revents & (EPOLLHUP | EPOLLERR))) connection.Close("");
  return 0;
}

int Connection::OnTurn(sd_event_source*, void* self) {
  static_cast<Connection*>(self)->Serve();
  return 0;
}

/// Reads once: what is left wakes the loop again. False: closed.
bool Connection::Read() {
  std::array<char, 65536> bytes;
  const ssize_t count = recv(socket_, bytes.data(), bytes.size(), 0);
  if (count > 0) {
    frames_.Append({bytes.data(), static_cast<std::size_t>(count)});
  } else if (count == 0) {
    peer_done_ = true;
  } else if (errno != EAGAIN && errno != EINTR) {
    return Close(""), false;
  }
  return true;
}

bool Connection::MayServe() const {
  return socket_ >= 0 && !current_ && output_.size() - written_ < limits_.busy_bytes;
}

void Connection::Serve() {
  if (serving_) return;
  serving_ = true;
  bool more_to_come = true;  // whole messages may be left
  for (int served = 0; served < kCallsPerTurn && more_to_come && MayServe(); ++served) {
    const auto message = frames_.Next();
    more_to_come = message && *message;
    if (!message) Close(message.error().message);
    if (more_to_come) ServeOne(**message);
  }
  serving_ = false;
  if (socket_ >= 0) Flush();
  // Others first: what is left has to wait for the next turn, unless a reply or the peer has to come first anyway.
  const bool again = more_to_come && MayServe();
  if (socket_ >= 0) sd_event_source_set_enabled(turn_.get(), again ? SD_EVENT_ONESHOT : SD_EVENT_OFF);
  if (socket_ >= 0 && peer_done_ && !current_ && !more_to_come && output_.empty()) Close("");
}

void Connection::ServeOne(std::string_view message) {
  Result<proto::ReceivedCall> call = proto::ReceiveCall(message);
  if (!call) return Close(call.error().message);
  const bool oneway = call->oneway;
  auto exchange = std::make_shared<Exchange>(*std::move(call), oneway ? nullptr : this);
  if (!oneway) current_ = exchange;
  dispatch_(exchange);
}

void Connection::Send(std::string_view message) {
  output_ += message;
  if (!serving_) Flush();
}

void Connection::SendLast(std::string_view message) {
  current_.reset();
  Send(message);
  if (!serving_ && socket_ >= 0) sd_event_source_set_enabled(turn_.get(), SD_EVENT_ONESHOT);
}

void Connection::AtClose(std::uint64_t key, std::move_only_function<void()> closed) {
  if (!closed) {
    at_close_.erase(key);
  } else if (socket_ >= 0) {
    at_close_[key] = std::move(closed);
  }
}

/// Writes what the socket takes; when all is gone, a stream may produce more.
void Connection::Flush() {
  if (flushing_) return;
  flushing_ = true;
  while (WriteSome() && output_.empty() && current_) {
    const ExchangePointer draining = current_;  // it may finish, or close us, meanwhile
    draining->PeerDrained();
    if (output_.empty()) break;
  }
  flushing_ = false;
  if (socket_ >= 0) Watch();
}

/// False: closed.
bool Connection::WriteSome() {
  while (socket_ >= 0 && written_ < output_.size()) {
    const ssize_t count = send(socket_, output_.data() + written_, output_.size() - written_, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) break;
    if (count < 0) return Close(""), false;
    written_ += static_cast<std::size_t>(count);
  }
  if (socket_ < 0) return false;
  if (output_.size() - written_ > limits_.output_bytes) return Close("it reads too slowly"), false;
  if (written_ == output_.size()) {
    output_.clear();
    written_ = 0;
  } else if (written_ > limits_.busy_bytes) {
    output_.erase(0, std::exchange(written_, 0));
  }
  return true;
}

/// Asks the loop only for what can be used now; a hang-up is always told.
void Connection::Watch() {
  unsigned events = 0;
  if (!peer_done_ && frames_.pending() <= proto::kMaxMessageBytes) events |= EPOLLIN;
  if (!output_.empty()) events |= EPOLLOUT;
  sd_event_source_set_io_events(source_.get(), events);
}

void Connection::Close(std::string_view reason) {
  if (socket_ < 0) return;
  sd_event_source_set_enabled(source_.get(), SD_EVENT_OFF);
  sd_event_source_set_enabled(turn_.get(), SD_EVENT_OFF);
  close(std::exchange(socket_, -1));
  if (const ExchangePointer gone = std::exchange(current_, nullptr)) gone->PeerGone();
  for (auto& [key, closed] : std::exchange(at_close_, {})) closed();
  closed_(*this, reason);
}

}  // namespace lensd::daemon
