// Sends calls and takes answers in their order; an answer that nobody asked for is a fault.
#include "client.h"

#include <errno.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "varlink/message.h"

namespace lensd::year {

namespace {

/// When a preset was saved is the one thing told that the time of day decides.
std::string WithoutDates(std::string_view message) {
  constexpr std::string_view kKey = "\"saved\":\"";
  constexpr std::size_t kDate = 20;
  std::string text(message);
  for (std::size_t at = text.find(kKey); at != std::string::npos; at = text.find(kKey, at + 1)) {
    text.erase(at + kKey.size(), kDate);
  }
  return text;
}

}  // namespace

void Client::Connect(const std::string& address, int epoll) {
  static constexpr std::array<machine::Peer, 3> kPeers = {{{1003, 65534}, {1002, 100}, {1001, 4}}};
  static std::uint64_t connections = 0;
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  address.copy(at.sun_path + 1, sizeof at.sun_path - 1);
  socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) machine::Found("it gets no socket to connect with");
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    machine::Found("it cannot be connected to");
  machine::NextPeer(kPeers.at(static_cast<std::size_t>(role_)));
  connection_ = ++connections;
  frames_ = varlink::FrameReader(varlink::kMaxReplyBytes);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = socket_;
  epoll_ctl(epoll, EPOLL_CTL_ADD, socket_, &event);
}

void Client::Send(const Call& call, const Json& parameters) {
  const std::string message =
      varlink::EncodeCall({"io.lensd.Lens." + call.method, parameters, call.oneway, call.more, false});
  machine::Trace(std::to_string(number_) + " > " + message);
  const ssize_t sent = send(socket_, message.data(), message.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno == EPIPE) return;  // that is told when it is read
  if (sent != static_cast<ssize_t>(message.size())) machine::Found("it reads no more");
  if (!call.oneway) waiting_.push_back(call);
}

bool Client::Read() {
  std::array<char, 65536> bytes;
  while (connected()) {
    const ssize_t count = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count < 0 && errno == EAGAIN) return true;
    if (count <= 0) return false;
    frames_.Append({bytes.data(), static_cast<std::size_t>(count)});
    for (;;) {
      const auto message = frames_.Next();
      if (!message) machine::Found("a reply is no message");
      if (!*message) break;
      Take(std::string(**message));
      if (!connected()) return true;
    }
  }
  return true;
}

void Client::Take(std::string_view message) {
  machine::Trace(std::to_string(number_) + " < " + WithoutDates(message));
  if (waiting_.empty()) machine::Found("an answer that nobody asked for: " + std::string(message));
  const Json reply = Json::parse(message, nullptr, false);
  if (!reply.is_object()) machine::Found("an answer is no object: " + std::string(message));
  const bool last = !reply.value("continues", false);
  const Call call = waiting_.front();
  if (!last && !call.more) machine::Found("a reply goes on that may not: " + std::string(message));
  if (last) waiting_.pop_front();
  answered_(*this, call, reply, last);
}

std::deque<Call> Client::Close() {
  if (connected()) close(std::exchange(socket_, -1));
  return std::exchange(waiting_, {});
}

}  // namespace lensd::year
