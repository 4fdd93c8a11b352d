// A non-blocking Varlink client in the event loop. Errors are always told from the loop, never from the constructor.
#include "web/link/upstream.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace lensd::web {
namespace {

constexpr std::size_t kFilesAtOnce = 16;

/// Takes the files out of a message's ancillary data, so that each is closed whatever happens.
void TakeFiles(msghdr& message, std::vector<File>& files) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(part) + i * sizeof(int), sizeof(int));
      files.emplace_back(number);
    }
  }
}

}  // namespace

UpstreamCall::UpstreamCall(EventLoop& loop, const std::string& path, const varlink::Call& call, Duration limit,
                           Listener listener)
    : loop_(loop), listener_(std::move(listener)), unsent_(varlink::EncodeCall(call)) {
  if (auto connected = Connect(path); !connected) {
    limit_ = loop_.Soon([this, why = connected.error()] { End(why); });
    return;
  }
  limit_ = loop_.After(limit, [this] { End({Code::Timeout, "lensd did not answer in time"}); });
  WatchFor(EPOLLIN | EPOLLOUT);
}

Result<void> UpstreamCall::Connect(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  socket_ = File(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket_.get() < 0) return Fail(Code::Io, std::string("no socket to be had: ") + std::strerror(errno));
  if (connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return {};
  return Fail(Code::Disconnected, "lensd does not answer at " + path + ": " + std::strerror(errno) + "; start lensd");
}

void UpstreamCall::WatchFor(std::uint32_t events) {
  watch_.reset();  // one descriptor is watched once at a time
  watch_ = loop_.OnDescriptor(socket_.get(), events, [this](std::uint32_t came) { Ready(came); });
}

void UpstreamCall::Ready(std::uint32_t events) {
  const std::weak_ptr<bool> alive = alive_;
  auto done = (events & EPOLLOUT) != 0 ? Write() : Result<void>{};
  if (done && (events & ~EPOLLOUT) != 0) done = Read();
  if (!alive.expired() && !done) End(done.error());
}

Result<void> UpstreamCall::Write() {
  const ssize_t count = send(socket_.get(), unsent_.data(), unsent_.size(), MSG_NOSIGNAL);
  if (count > 0) unsent_.erase(0, static_cast<std::size_t>(count));
  // Refused at the door: the reason may be waiting to be received.
  if (count < 0 && errno == EPIPE) unsent_.clear();
  if (count < 0 && errno != EAGAIN && errno != EINTR && errno != EPIPE) {
    return Fail(Code::Disconnected, std::string("lensd cannot be written to: ") + std::strerror(errno));
  }
  if (unsent_.empty()) WatchFor(EPOLLIN);
  return {};
}

Result<void> UpstreamCall::Read() {
  std::array<char, 65536> bytes;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kFilesAtOnce * sizeof(int))> control;
  iovec part{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = recvmsg(socket_.get(), &message, MSG_CMSG_CLOEXEC);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  if (count < 0) return Fail(Code::Disconnected, std::string("lensd cannot be read from: ") + std::strerror(errno));
  if (count == 0) return Fail(Code::Disconnected, "lensd closed the connection");
  TakeFiles(message, files_);
  frames_.Append({bytes.data(), static_cast<std::size_t>(count)});
  TellReplies();
  return {};
}

void UpstreamCall::TellReplies() {
  const std::weak_ptr<bool> alive = alive_;
  const auto tell = listener_.reply;  // outlives this object, which it may destroy
  while (!alive.expired()) {
    auto message = frames_.Next();
    if (message && !*message) return;
    auto reply = message ? varlink::ParseReply(**message) : PassOn(message);
    if (!reply) return End(reply.error());
    File file;
    if (reply->parameters.contains("fd") && !files_.empty()) {
      file = std::move(files_.front());
      files_.erase(files_.begin());
    }
    if (!reply->continues) {
      watch_.reset();
      limit_.reset();
      tell(std::move(*reply), std::move(file));
      return;
    }
    tell(std::move(*reply), std::move(file));
  }
}

void UpstreamCall::End(const Error& why) {
  watch_.reset();
  limit_.reset();
  const auto failed = listener_.failed;  // outlives this object, which it may destroy
  failed(why);
}

}  // namespace lensd::web
