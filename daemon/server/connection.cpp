// One client's socket: bytes in, messages to the router, replies out in order. What a client may make the daemon hold
// is bounded here.
#include "daemon/server/connection.h"

#include <linux/sockios.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

namespace lensd::daemon {
namespace {

/// Calls served in one turn of the loop, so that one busy client cannot starve the others.
constexpr int kCallsPerTurn = 32;
/// Once calls have taken as long, those that are read only now wait until everything was read: a stop may be among it.
constexpr Duration kTurn = std::chrono::microseconds(500);
constexpr std::size_t kReadBytes = std::size_t{16} << 10;
/// Calls that wait beyond this are left in the socket.
constexpr std::size_t kInboxBytes = std::size_t{1} << 20;
/// Reading goes before serving.
constexpr std::int64_t kTurnPriority = SD_EVENT_PRIORITY_NORMAL + 10;

Instant Now() {
  return MonotonicClock().Now();
}

}  // namespace

Result<std::unique_ptr<Connection>> Connection::Create(ConnectionHost& host, int socket, Guest guest, Closed closed) {
  std::unique_ptr<Connection> made(new Connection(host, socket, std::move(guest), std::move(closed)));
  sd_event_source* source = nullptr;
  sd_event_source* turn = nullptr;
  int status = sd_event_add_io(host.loop.get(), &source, socket, EPOLLIN, OnSocket, made.get());
  made->source_.reset(source);
  if (status >= 0) status = sd_event_add_defer(host.loop.get(), &turn, OnTurn, made.get());
  made->turn_.reset(turn);
  if (status >= 0) status = sd_event_source_set_priority(turn, kTurnPriority);
  if (status < 0) return Fail(Code::Io, std::string("cannot watch a connection: ") + std::strerror(-status));
  sd_event_source_set_enabled(turn, SD_EVENT_OFF);
  return made;
}

Connection::Connection(ConnectionHost& host, int socket, Guest guest, Closed closed)
    : host_(host), socket_(socket), guest_(std::move(guest)), closed_(std::move(closed)) {
  inbox_.last_read = Now();
}

std::string Connection::caller() const {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket_, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return "an unknown client";
  std::string program;
  std::getline(std::ifstream("/proc/" + std::to_string(peer.pid) + "/comm"), program);
  if (program.empty()) program = "process";  // ended, or of another container
  std::ranges::replace_if(program, [](char c) { return c < ' ' || c > '~'; }, '?');
  return program + "[" + std::to_string(peer.pid) + "] of user " + std::to_string(peer.uid);
}

Connection::~Connection() {
  if (current_) current_->connection_ = nullptr;
  for (const Incoming& message : inbox_.messages) {
    if (message.early) message.early->connection_ = nullptr;
  }
  if (socket_ >= 0) close(socket_);
}

int Connection::OnSocket(sd_event_source*, int, unsigned revents, void* self) {
  auto& connection = *static_cast<Connection*>(self);
  if (revents & EPOLLIN) {
    // What a peer sent before it went still counts: a last oneway call is carried out.
    if (!connection.Read()) return 0;
    connection.TakeTurn();
  }
  if (connection.socket_ >= 0 && (revents & EPOLLOUT)) {
    connection.Flush();
    connection.TakeTurn();
  }
  if (connection.socket_ >= 0 && (revents & (EPOLLHUP | EPOLLERR))) connection.HangUp();
  return 0;
}

/// The client reads no replies any more. The loop would tell of a hang-up without end, so turns alone go on.
void Connection::HangUp() {
  inbox_.peer_gone = true;
  sd_event_source_set_enabled(source_.get(), SD_EVENT_OFF);
  output_ = {};
  if (const ExchangePointer gone = std::exchange(current_, nullptr)) gone->PeerGone();
  while (!inbox_.peer_done && HasRoom()) {
    if (!Read()) return;
  }
  if (inbox_.messages.empty()) return Serve();  // nothing is left, so what it held is free at once
  sd_event_source_set_enabled(turn_.get(), SD_EVENT_ONESHOT);
}

/// Serves now, or when everything was read. What has acted already only waits for its reply.
void Connection::TakeTurn() {
  const bool acted = !inbox_.messages.empty() && inbox_.messages.front().early;
  if (acted || host_.budget.spent < kTurn) return Serve();
  Watch();
  sd_event_source_set_enabled(turn_.get(), SD_EVENT_ONESHOT);
}

int Connection::OnTurn(sd_event_source*, void* self) {
  auto& connection = *static_cast<Connection*>(self);
  connection.host_.budget.spent = {};
  const bool may_read = connection.inbox_.peer_gone && !connection.inbox_.peer_done && connection.HasRoom();
  if (!may_read || connection.Read()) connection.Serve();
  return 0;
}

/// Reads once: what is left wakes the loop again. False: closed.
bool Connection::Read() {
  std::array<char, kReadBytes> bytes;
  const ssize_t count = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (count > 0) {
    inbox_.frames.Append({bytes.data(), static_cast<std::size_t>(count)});
    inbox_.last_read = Now();
    Sort();
  } else if (count == 0) {
    inbox_.peer_done = true;
  } else if (errno != EAGAIN && errno != EINTR) {
    return Close(""), false;
  }
  return true;
}

/// Puts whole messages into the inbox; what acts when it is read does.
void Connection::Sort() {
  const bool was_serving = std::exchange(serving_, true);
  while (inbox_.broken.empty()) {
    const auto message = inbox_.frames.Next();
    if (!message) inbox_.broken = message.error().message;
    if (!message || !*message) break;
    Incoming incoming{++host_.calls_read, std::string(**message), nullptr};
    inbox_.bytes += SizeOf(incoming);
    if (host_.acts_when_read(incoming.text)) {
      auto call = varlink::ReceiveCall(incoming.text);
      if (call && host_.acts_when_read(call->method + "\"")) {
        incoming.early = Begin(*std::move(call), incoming.number);
        incoming.early->in_turn_ = false;
        host_.dispatch(incoming.early);
      }
    }
    inbox_.messages.push_back(std::move(incoming));
  }
  serving_ = was_serving;
}

bool Connection::MayServe() const {
  return socket_ >= 0 && !current_ && output_.bytes.size() - output_.written < host_.limits.busy_bytes &&
         *oneway_ < host_.limits.oneway_calls;
}

void Connection::Serve() {
  if (serving_) return;
  serving_ = true;
  const Instant began = Now();
  Instant now = began;
  for (int served = 0; served < kCallsPerTurn && now - began < kTurn && !inbox_.messages.empty() && MayServe();
       ++served) {
    const Incoming message = std::move(inbox_.messages.front());
    inbox_.messages.pop_front();
    inbox_.bytes -= SizeOf(message);
    ServeOne(message);
    now = Now();
  }
  host_.budget.spent += now - began;
  serving_ = false;
  if (socket_ >= 0 && inbox_.messages.empty() && !inbox_.broken.empty()) Close(inbox_.broken);
  if (socket_ >= 0) Flush();
  // Others first: what is left has to wait for the next turn, unless a reply or the peer has to come first anyway.
  const bool again = inbox_.messages.empty() ? inbox_.peer_gone && !inbox_.peer_done : MayServe();
  if (socket_ >= 0) sd_event_source_set_enabled(turn_.get(), again ? SD_EVENT_ONESHOT : SD_EVENT_OFF);
  if (socket_ >= 0 && inbox_.peer_done && !current_ && inbox_.messages.empty() && output_.bytes.empty()) Close("");
}

ExchangePointer Connection::Begin(varlink::ReceivedCall call, std::uint64_t number) {
  const bool oneway = call.oneway;
  auto exchange = std::make_shared<Exchange>(std::move(call), oneway ? nullptr : this, guest_.credentials, number);
  if (!oneway) return exchange;
  ++*oneway_;
  exchange->ended_ = [this, alive = std::weak_ptr(oneway_)] {
    const auto unfinished = alive.lock();
    if (!unfinished) return;
    --*unfinished;
    if (!serving_ && socket_ >= 0) sd_event_source_set_enabled(turn_.get(), SD_EVENT_ONESHOT);
  };
  return exchange;
}

void Connection::ServeOne(const Incoming& message) {
  ExchangePointer exchange = message.early;
  if (!exchange) {
    Result<varlink::ReceivedCall> call = varlink::ReceiveCall(message.text);
    if (!call) return Close(call.error().message);
    if (inbox_.peer_gone && !call->oneway) return;
    exchange = Begin(*std::move(call), message.number);
  }
  if (inbox_.peer_gone && exchange->connection_ != nullptr) return exchange->PeerGone();
  if (exchange->connection_ != nullptr) current_ = exchange;
  exchange->in_turn_ = true;
  if (message.early) {
    if (auto held = std::exchange(exchange->held_, std::nullopt)) exchange->SendLast(*std::move(held));
  } else if (!guest_.restriction.error.empty()) {
    exchange->Refuse(guest_.restriction.error, {{"message", guest_.restriction.message}});
    inbox_.messages.clear();
    inbox_.peer_done = true;
  } else {
    host_.dispatch(exchange);
  }
}

void Connection::Send(std::string_view message, Descriptor file) {
  if (inbox_.peer_gone) return;
  if (file) output_.files.push_back({output_.bytes.size(), std::move(file)});
  output_.bytes += message;
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

std::size_t Connection::unread() const {
  int in_socket = 0;
  if (socket_ >= 0) (void)ioctl(socket_, SIOCOUTQ, &in_socket);
  return output_.bytes.size() - output_.written + static_cast<std::size_t>(std::max(in_socket, 0));
}

/// Writes what the socket takes; when all is gone, a stream may produce more.
void Connection::Flush() {
  if (output_.flushing) return;
  output_.flushing = true;
  while (WriteSome() && output_.bytes.empty() && current_) {
    const ExchangePointer draining = current_;  // it may finish, or close us, meanwhile
    draining->PeerDrained();
    if (output_.bytes.empty()) break;
  }
  output_.flushing = false;
  if (socket_ >= 0) Watch();
}

/// Writes up to the next message that a file goes with, which a file of this one is sent along with.
ssize_t Connection::WriteOnce() {
  auto& files = output_.files;
  const bool attached = !files.empty() && files.front().at == output_.written;
  const std::size_t next = attached ? 1 : 0;
  const std::size_t end = files.size() > next ? files[next].at : output_.bytes.size();
  iovec bytes{output_.bytes.data() + output_.written, end - output_.written};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  if (attached) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(int));
    const int number = files.front().file.get();
    std::memcpy(CMSG_DATA(header), &number, sizeof number);
  }
  const ssize_t count = sendmsg(socket_, &message, MSG_NOSIGNAL);
  if (count > 0 && attached) files.pop_front();
  return count;
}

/// False: closed.
bool Connection::WriteSome() {
  while (socket_ >= 0 && output_.written < output_.bytes.size()) {
    const ssize_t count = WriteOnce();
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) break;
    if (count < 0) return Close(""), false;
    output_.written += static_cast<std::size_t>(count);
  }
  if (socket_ < 0) return false;
  if (output_.bytes.size() - output_.written > host_.limits.output_bytes) return Close("it reads too slowly"), false;
  if (output_.written == output_.bytes.size()) {
    output_.bytes.clear();
    output_.written = 0;
  } else if (output_.written > host_.limits.busy_bytes) {
    for (auto& attached : output_.files) attached.at -= output_.written;
    output_.bytes.erase(0, std::exchange(output_.written, 0));
  }
  return true;
}

bool Connection::HasRoom() const {
  return inbox_.bytes <= kInboxBytes && inbox_.frames.pending() <= varlink::kMaxMessageBytes;
}

/// Asks the loop only for what can be used now; a hang-up is always told.
void Connection::Watch() {
  unsigned events = 0;
  if (!inbox_.peer_done && HasRoom()) events |= EPOLLIN;
  if (!output_.bytes.empty()) events |= EPOLLOUT;
  sd_event_source_set_io_events(source_.get(), events);
}

void Connection::Close(std::string_view reason) {
  if (socket_ < 0) return;
  sd_event_source_set_enabled(source_.get(), SD_EVENT_OFF);
  sd_event_source_set_enabled(turn_.get(), SD_EVENT_OFF);
  close(std::exchange(socket_, -1));
  if (const ExchangePointer gone = std::exchange(current_, nullptr)) gone->PeerGone();
  for (const Incoming& message : std::exchange(inbox_.messages, {})) {
    if (message.early) message.early->PeerGone();
  }
  for (auto& [key, closed] : std::exchange(at_close_, {})) closed();
  closed_(*this, reason);
}

}  // namespace lensd::daemon
