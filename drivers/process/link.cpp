// Every wait has a deadline, since the other side may be anybody's program.
#include "link.h"

#include <poll.h>
#include <sched.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <string>
#include <utility>

#include "proto/driver_interface.h"

namespace lensd::drivers::process {
namespace {

/// Most replies take less than it takes to put a processor to sleep and wake it again.
constexpr Duration kAwakeAtMost = std::chrono::microseconds(50);

/// Looks without sleeping. Lets others run, who may be the driver.
void LookAwhile(std::array<pollfd, 2>& waits) {
  const Instant end = MonotonicClock().Now() + kAwakeAtMost;
  while (poll(waits.data(), waits.size(), 0) == 0 && MonotonicClock().Now() < end) sched_yield();
}

/// Waits until one of them is readable. False: the deadline came first.
bool WaitForEither(std::array<pollfd, 2>& waits, Instant deadline) {
  LookAwhile(waits);
  for (;;) {
    const Duration left = std::max(deadline - MonotonicClock().Now(), Duration::zero());
    const timespec at_most{static_cast<std::time_t>(left / std::chrono::seconds(1)),
                           static_cast<long>((left % std::chrono::seconds(1)).count())};
    const int ready = ppoll(waits.data(), waits.size(), &at_most, nullptr);
    if (ready > 0) return true;
    if (ready == 0 && left == Duration::zero()) return false;
    if (ready < 0 && errno != EINTR) return false;
  }
}

}  // namespace

Link::Link(daemon::Descriptor socket) : channel_(std::move(socket), varlink::kMaxReplyBytes) {}

Result<std::uint64_t> Link::Send(std::string_view method, varlink::Json parameters, Instant deadline, int pass) {
  varlink::Call call;
  call.method = std::string(proto::kDriverInterface) + "." + std::string(method);
  call.parameters = std::move(parameters);
  const std::string message = varlink::EncodeCall(call);
  if (message.size() > varlink::kMaxMessageBytes) return Fail(Code::BadData, "these settings are longer than 1 MiB");
  const std::uint64_t number = ++sent_;
  auto sent = channel_.Send(message, deadline, pass);
  if (sent) return number;
  --sent_;  // no reply comes
  return PassOn(sent);
}

Result<varlink::Reply> Link::Receive(std::uint64_t number, Instant deadline, int wake) {
  for (;;) {
    const auto message = channel_.Next();
    if (!message) return PassOn(message);
    if (*message) {
      auto reply = varlink::ParseReply(**message);
      if (!reply) return reply;
      if (reply->continues) return Fail(Code::Protocol, "it replied more than once");
      if (++received_ > sent_) return Fail(Code::Protocol, "it replied without a call");
      if (received_ == number) return reply;
      continue;
    }
    std::array<pollfd, 2> waits{{{channel_.descriptor(), POLLIN, 0}, {wake, POLLIN, 0}}};
    if (!WaitForEither(waits, deadline)) return Fail(Code::Timeout, "no reply in time");
    if (waits[0].revents == 0) return Fail(Code::Cancelled, "interrupted");
    if (auto received = channel_.Receive(wire::Channel::Wait::No); !received) return PassOn(received);
    while (channel_.TakeDescriptor()) {
      // Nothing that a driver passes is wanted.
    }
  }
}

void Link::Shut() {
  shutdown(channel_.descriptor(), SHUT_RDWR);
}

}  // namespace lensd::drivers::process
