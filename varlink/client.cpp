// A blocking client on one Unix socket. Every wait is a poll() with the deadline and, where set, an interrupting
// descriptor; a reply cut short is an error.
#include "varlink/client.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace lensd::varlink {
namespace {

std::string Reason(int error_number) {
  return std::strerror(error_number);
}

/// poll()'s timeout: rounded up, so that a deadline is never missed by spinning.
int MillisecondsUntil(const std::optional<Instant>& deadline) {
  if (!deadline) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(*deadline - MonotonicClock().Now()).count();
  return static_cast<int>(std::clamp<decltype(left)>(left, 0, 1'000'000'000));
}

}  // namespace

Client::Client(Client&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      interrupt_(other.interrupt_),
      deadline_(other.deadline_),
      frames_(std::move(other.frames_)),
      unanswered_(other.unanswered_),
      given_up_(other.given_up_) {}

Client& Client::operator=(Client&& other) noexcept {
  std::swap(socket_, other.socket_);
  interrupt_ = other.interrupt_;
  deadline_ = other.deadline_;
  frames_ = std::move(other.frames_);
  unanswered_ = other.unanswered_;
  given_up_ = other.given_up_;
  return *this;
}

Client::~Client() {
  if (socket_ >= 0) close(socket_);
}

Result<Client> Client::Connect(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return Fail(Code::InvalidArgument, "a socket path has 1 to " + std::to_string(sizeof(address.sun_path) - 1) +
                                           " characters; this one has " + std::to_string(path.size()));
  }
  path.copy(address.sun_path, path.size());
  Client client(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (client.socket_ < 0) return Fail(Code::Io, "no socket to be had: " + Reason(errno));
  if (connect(client.socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return Fail(Code::Disconnected, "no daemon answers at " + path + ": " + Reason(errno) +
                                        "; start lensd, or name its socket with --socket or LENSD_SOCKET");
  }
  return client;
}

Result<void> Client::WaitFor(short events) {
  std::array<pollfd, 2> waits{pollfd{socket_, events, 0}, pollfd{interrupt_, POLLIN, 0}};
  for (;;) {
    const int ready = poll(waits.data(), waits.size(), MillisecondsUntil(deadline_));
    if (ready == 0) return Fail(Code::Timeout, "the daemon did not answer in time");
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) return Fail(Code::Io, "poll: " + Reason(errno));
    if (waits[1].revents != 0) return Fail(Code::Cancelled, "interrupted");
    return {};
  }
}

Result<void> Client::Send(const Call& call) {
  const std::string message = EncodeCall(call);
  std::size_t sent = 0;
  if (!call.oneway) given_up_ = unanswered_++;
  while (sent < message.size()) {
    const ssize_t count = send(socket_, message.data() + sent, message.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count >= 0) {
      sent += static_cast<std::size_t>(count);
    } else if (errno == EAGAIN) {
      if (auto waited = WaitFor(POLLOUT); !waited) return waited;
    } else if (errno == EPIPE) {
      return {};  // refused at the door: the reason may be waiting to be received
    } else if (errno != EINTR) {
      return Fail(Code::Io, "the daemon cannot be written to: " + Reason(errno));
    }
  }
  return {};
}

Result<Reply> Client::Receive() {
  for (;;) {
    auto message = frames_.Next();
    if (!message) return PassOn(message);
    if (*message) {
      auto reply = ParseReply(**message);
      const bool late = given_up_ > 0;
      if (reply && !reply->continues) {
        --unanswered_;
        if (late) --given_up_;
      }
      if (reply && late) continue;
      return reply;
    }
    if (auto waited = WaitFor(POLLIN); !waited) return PassOn(waited);
    std::array<char, 65536> bytes;
    const ssize_t count = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count > 0) {
      frames_.Append({bytes.data(), static_cast<std::size_t>(count)});
    } else if (count == 0) {
      return Fail(Code::Disconnected, "the daemon closed the connection");
    } else if (errno != EAGAIN && errno != EINTR) {
      return Fail(Code::Io, "the daemon cannot be read from: " + Reason(errno));
    }
  }
}

Result<Reply> Client::Invoke(std::string_view method, Json parameters) {
  Call call;
  call.method = method;
  call.parameters = std::move(parameters);
  if (auto sent = Send(call); !sent) return PassOn(sent);
  return Receive();
}

}  // namespace lensd::varlink
