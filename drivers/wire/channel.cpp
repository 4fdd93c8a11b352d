// Descriptors travel with the first byte of their message. More than a few that nobody takes are closed.
#include "drivers/wire/channel.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace lensd::drivers::wire {
namespace {

constexpr std::size_t kMostDescriptors = 4;

/// Room for the descriptors of one message, aligned as the kernel wants it.
struct Control {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMostDescriptors * sizeof(int))> bytes{};
};

void PutDescriptor(msghdr& message, Control& control, int descriptor) {
  message.msg_control = control.bytes.data();
  message.msg_controllen = CMSG_SPACE(sizeof(int));
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
}

std::string Why(int error_number) {
  return std::strerror(error_number);
}

}  // namespace

Result<void> Channel::Send(std::string_view message, Instant deadline, int pass) {
  Control control;
  while (!message.empty()) {
    iovec bytes{const_cast<char*>(message.data()), message.size()};  // only read there
    msghdr out{};
    out.msg_iov = &bytes;
    out.msg_iovlen = 1;
    if (pass >= 0) PutDescriptor(out, control, pass);
    const ssize_t sent = sendmsg(socket_.get(), &out, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) {
      message.remove_prefix(static_cast<std::size_t>(sent));
      pass = -1;
    } else if (errno == EAGAIN) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - MonotonicClock().Now()).count();
      if (left <= 0) return Fail(Code::Timeout, "the other side does not read");
      pollfd writable{socket_.get(), POLLOUT, 0};
      poll(&writable, 1, static_cast<int>(std::min<std::int64_t>(left, 60'000)));
    } else if (errno == EPIPE || errno == ECONNRESET) {
      return Fail(Code::Disconnected, "the connection is closed");
    } else if (errno != EINTR) {
      return Fail(Code::Io, "cannot send: " + Why(errno));
    }
  }
  return {};
}

Result<void> Channel::Receive(Wait wait) {
  std::array<char, 65536> bytes;
  Control control;
  iovec into{bytes.data(), bytes.size()};
  msghdr in{};
  in.msg_iov = &into;
  in.msg_iovlen = 1;
  in.msg_control = control.bytes.data();
  in.msg_controllen = control.bytes.size();
  const ssize_t count = recvmsg(socket_.get(), &in, MSG_CMSG_CLOEXEC | (wait == Wait::No ? MSG_DONTWAIT : 0));
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  if (count == 0 || (count < 0 && errno == ECONNRESET)) return Fail(Code::Disconnected, "the connection is closed");
  if (count < 0) return Fail(Code::Io, "cannot receive: " + Why(errno));
  for (cmsghdr* header = CMSG_FIRSTHDR(&in); header != nullptr; header = CMSG_NXTHDR(&in, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t many = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < many; ++i) {
      int descriptor = -1;
      std::memcpy(&descriptor, CMSG_DATA(header) + i * sizeof(int), sizeof descriptor);
      came_.emplace_back(descriptor);
    }
  }
  if (came_.size() > kMostDescriptors) came_.resize(kMostDescriptors);
  frames_.Append({bytes.data(), static_cast<std::size_t>(count)});
  return {};
}

daemon::Descriptor Channel::TakeDescriptor() {
  if (came_.empty()) return {};
  daemon::Descriptor first = std::move(came_.front());
  came_.erase(came_.begin());
  return first;
}

}  // namespace lensd::drivers::wire
