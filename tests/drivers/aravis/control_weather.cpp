// Stands before the C library's sendmsg() for the whole process; packets that are not GigE Vision control pass through.
#include "control_weather.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

namespace lensd::testing {
namespace {

constexpr std::uint16_t kPort = 3956;
constexpr std::uint16_t kReadRegisterAnswer = 0x0081, kReadMemoryAnswer = 0x0085;
constexpr std::size_t kHeader = 8, kWord = 4;

ControlWeather weather;

int Whole(int below) {
  thread_local std::mt19937 random{std::random_device{}()};
  return std::uniform_int_distribution(0, below - 1)(random);
}

bool IsControl(const sockaddr_in& address) {
  return address.sin_family == AF_INET && ntohs(address.sin_port) == kPort;
}

std::size_t SizeOf(const msghdr& message) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < message.msg_iovlen; ++i) size += message.msg_iov[i].iov_len;
  return size;
}

std::uint16_t WordAt(const std::vector<unsigned char>& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

/// Whether these are what was read: then the last word becomes another: that of a status, of a place, or of the answer
/// before.
bool Falsify(std::vector<unsigned char>& bytes) {
  if (bytes.size() < kHeader + kWord) return false;
  const std::uint16_t answer = WordAt(bytes, 2);
  if (answer != kReadRegisterAnswer && answer != kReadMemoryAnswer) return false;
  thread_local std::uint32_t before = 0;
  std::uint32_t now = 0;
  std::memcpy(&now, bytes.data() + bytes.size() - kWord, kWord);
  const std::array<std::uint32_t, 3> lies = {htonl(static_cast<std::uint32_t>(Whole(6))),
                                             htonl(static_cast<std::uint32_t>(Whole(4001))), before};
  before = now;
  std::memcpy(bytes.data() + bytes.size() - kWord, &lies[static_cast<std::size_t>(Whole(3))], kWord);
  return true;
}

using Send = ssize_t (*)(int, const msghdr*, int);

ssize_t SendAnswer(Send send, int socket, const msghdr* message, int flags) {
  if (Whole(100) < weather.late) {
    ++weather.all_late;
    std::this_thread::sleep_for(std::chrono::milliseconds(Whole(weather.late_ms + 1)));
  }
  if (Whole(100) >= weather.falsified) return send(socket, message, flags);
  std::vector<unsigned char> bytes;
  for (std::size_t i = 0; i < message->msg_iovlen; ++i) {
    const auto* begin = static_cast<const unsigned char*>(message->msg_iov[i].iov_base);
    bytes.insert(bytes.end(), begin, begin + message->msg_iov[i].iov_len);
  }
  if (!Falsify(bytes)) return send(socket, message, flags);
  ++weather.all_falsified;
  iovec whole{bytes.data(), bytes.size()};
  msghdr changed = *message;
  changed.msg_iov = &whole;
  changed.msg_iovlen = 1;
  return send(socket, &changed, flags);
}

ssize_t SendInWeather(Send send, int socket, const msghdr* message, int flags) {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  const bool known = getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  const bool is_answer = known && IsControl(own);
  bool is_command = false;
  if (known && !is_answer && message->msg_name != nullptr && message->msg_namelen >= sizeof own) {
    sockaddr_in peer{};
    std::memcpy(&peer, message->msg_name, sizeof peer);
    is_command = IsControl(peer);
  }
  if ((is_answer || is_command) && Whole(100) < weather.lost) {
    ++weather.all_lost;
    return static_cast<ssize_t>(SizeOf(*message));
  }
  return is_answer ? SendAnswer(send, socket, message, flags) : send(socket, message, flags);
}

}  // namespace

ControlWeather& Weather() {
  return weather;
}

}  // namespace lensd::testing

extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  static const auto send = reinterpret_cast<lensd::testing::Send>(dlsym(RTLD_NEXT, "sendmsg"));
  return lensd::testing::SendInWeather(send, socket, message, flags);
}
