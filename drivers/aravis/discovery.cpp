// The discovery command of GigE Vision's control protocol, to one address.
#include "discovery.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

namespace lensd::drivers::aravis {
namespace {

constexpr std::uint16_t kControlPort = 3956;
constexpr int kTries = 4;
constexpr Duration kEachTry = std::chrono::milliseconds(250);
/// Key, "please acknowledge", DISCOVERY_CMD, no payload, a number for the answer to repeat.
constexpr std::array<unsigned char, 8> kQuestion = {0x42, 0x01, 0x00, 0x02, 0x00, 0x00, 0x4c, 0x44};
/// DISCOVERY_ACK; its status comes before.
constexpr std::array<unsigned char, 2> kAnswer = {0x00, 0x03};
constexpr std::size_t kHeader = 8;

bool IsAnswer(const unsigned char* packet, std::size_t size) {
  return size >= kHeader && std::equal(kAnswer.begin(), kAnswer.end(), packet + 2) &&
         std::equal(kQuestion.end() - 2, kQuestion.end(), packet + kHeader - 2);
}

sockaddr_in At(const std::string& host) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kControlPort);
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  return address;
}

std::string Numbers(const in_addr& host) {
  std::array<char, INET_ADDRSTRLEN> text{};
  return inet_ntop(AF_INET, &host, text.data(), text.size()) != nullptr ? text.data() : "";
}

Result<std::vector<std::string>> AddressesOf(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* list = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &list);
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(list, [](addrinfo* all) {
    if (all != nullptr) freeaddrinfo(all);
  });
  if (failed != 0) {
    return Fail(Code::Disconnected, "there is no host \"" + host + "\": " + gai_strerror(failed));
  }
  std::vector<std::string> addresses;
  for (const addrinfo* one = list; one != nullptr; one = one->ai_next) {
    sockaddr_in address{};
    std::memcpy(&address, one->ai_addr, sizeof address);
    addresses.push_back(Numbers(address.sin_addr));
  }
  return addresses;
}

struct DatagramSocket {
  DatagramSocket() : number(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {}
  ~DatagramSocket() {
    if (number >= 0) close(number);
  }
  DatagramSocket(const DatagramSocket&) = delete;
  DatagramSocket& operator=(const DatagramSocket&) = delete;

  const int number;
};

constexpr std::size_t kAddressBytes = 512;  ///< where the file is, as text
constexpr std::array<std::uint32_t, 2> kAddressesOfFile = {0x0200, 0x0400};

/// READMEM_CMD, which needs no control of the camera. Empty: no answer, or no such memory.
std::string AskMemory(int socket, std::uint32_t address) {
  if (socket < 0) return "";
  constexpr unsigned char kReadMemory = 0x84, kMemory = 0x85;
  const auto byte = [&](int shift) { return static_cast<unsigned char>(address >> shift); };
  const std::array<unsigned char, 16> question = {0x42,     0x01,     0x00,    kReadMemory, 0x00, 0x08, 0x4c, byte(8),
                                                  byte(24), byte(16), byte(8), byte(0),     0x00, 0x00, 0x02, 0x00};
  for (int i = 0; i < kTries; ++i) {
    if (send(socket, question.data(), question.size(), MSG_NOSIGNAL) < 0) return "";
    const Instant deadline = std::chrono::steady_clock::now() + kEachTry;
    for (Duration left = kEachTry; left > Duration{}; left = deadline - std::chrono::steady_clock::now()) {
      pollfd ready{.fd = socket, .events = POLLIN, .revents = 0};
      if (poll(&ready, 1, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count())) <= 0) break;
      std::array<char, 1024> packet{};
      const ssize_t size = recv(socket, packet.data(), packet.size(), 0);
      if (size < static_cast<ssize_t>(kHeader)) continue;
      const bool meant = packet[3] == static_cast<char>(kMemory) && packet[6] == static_cast<char>(question[6]) &&
                         packet[7] == static_cast<char>(question[7]);
      if (!meant) continue;
      if (packet[0] != 0 || packet[1] != 0) return "";
      constexpr std::size_t kData = kHeader + 4;
      if (static_cast<std::size_t>(size) < kData + kAddressBytes) return "";
      const char* text = packet.data() + kData;
      return {text, strnlen(text, kAddressBytes)};
    }
  }
  return "";
}

/// Of "Local:camera.xml;8000;1a2b?SchemaVersion=1.1.0", in bytes; 0 where it states none.
std::uint64_t SizeStated(const std::string& address) {
  const std::size_t first = address.find(';');
  const std::size_t second = first == std::string::npos ? first : address.find(';', first + 1);
  return second == std::string::npos ? 0 : std::strtoull(address.c_str() + second + 1, nullptr, 16);
}

Result<Route> AskAddress(const std::string& address) {
  Hail hail(address);
  Presence presence = Presence::Silent;
  for (int i = 0; i < kTries && (presence == Presence::Silent || presence == Presence::Stranger); ++i) {
    hail.Send();
    presence = hail.Wait(kEachTry);
  }
  switch (presence) {
    case Presence::Camera:
      return Route{.camera = address, .here = hail.here()};
    case Presence::Stranger:
      return Fail(Code::Protocol, "what answers at " + address + " is no GigE Vision camera");
    case Presence::Refuses:
      return Fail(Code::Disconnected, "the host at " + address + " is there and refuses: it is no GigE Vision camera");
    case Presence::Unreachable:
      return Fail(Code::Disconnected, address + " cannot be reached: " + hail.why());
    case Presence::Silent:
      break;
  }
  return Fail(Code::Disconnected, "nothing answers at " + address + "; is the camera connected and powered?");
}

}  // namespace

Hail::Hail(const std::string& address) : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  // Connected: the kernel says then whether a camera can be there, and passes on nothing from others.
  const sockaddr_in there = At(address);
  if (socket_ < 0 || connect(socket_, reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0) Fails(errno);
}

Hail::~Hail() {
  if (socket_ >= 0) close(socket_);
}

void Hail::Fails(int error) {
  if (error == EAGAIN || error == EINTR) return;
  error_ = error;
  presence_ = error == ECONNREFUSED ? Presence::Refuses : Presence::Unreachable;
}

void Hail::Send() {
  if (socket_ < 0 || presence_ == Presence::Unreachable || presence_ == Presence::Refuses) return;
  if (send(socket_, kQuestion.data(), kQuestion.size(), MSG_NOSIGNAL) < 0) Fails(errno);
}

Presence Hail::Wait(Duration limit) {
  const Instant deadline = std::chrono::steady_clock::now() + limit;
  while (presence_ == Presence::Silent || presence_ == Presence::Stranger) {
    const Duration left = std::max(deadline - std::chrono::steady_clock::now(), Duration{});
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    const auto ms = static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
    if (poll(&ready, 1, ms) <= 0) break;
    std::array<unsigned char, 1024> packet{};
    const ssize_t size = recv(socket_, packet.data(), packet.size(), 0);
    if (size < 0) {
      Fails(errno);
    } else {
      presence_ = IsAnswer(packet.data(), static_cast<std::size_t>(size)) ? Presence::Camera : Presence::Stranger;
    }
  }
  return presence_;
}

std::string Hail::here() const {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  if (getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size) != 0) return "";
  return Numbers(own.sin_addr);
}

std::string Hail::why() const {
  return std::strerror(error_);
}

Result<Route> AskCamera(const std::string& host) {
  const auto addresses = AddressesOf(host);
  if (!addresses) return PassOn(addresses);
  Result<Route> route = Fail(Code::Disconnected, "the host \"" + host + "\" has no address");
  for (const std::string& address : *addresses) {
    route = AskAddress(address);
    if (route) break;
  }
  return route;
}

Result<std::string> AskForFile(const Route& route) {
  constexpr std::uint64_t kLargest = std::uint64_t{16} << 20;
  const DatagramSocket asking;
  const sockaddr_in there = At(route.camera);
  if (asking.number < 0 || connect(asking.number, reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0) {
    return Fail(Code::Disconnected, route.camera + " cannot be reached: " + std::strerror(errno));
  }
  // The second counts where Aravis cannot use the first.
  std::string first = AskMemory(asking.number, kAddressesOfFile.front());
  if (first.empty()) {
    return Fail(Code::Disconnected, "the camera at " + route.camera + " does not say where its GenICam file is");
  }
  const std::string second = AskMemory(asking.number, kAddressesOfFile.back());
  const std::uint64_t size = std::max(SizeStated(first), SizeStated(second));
  if (size <= kLargest) return first;
  return Fail(Code::Unsupported, "the camera at " + route.camera + " says that its GenICam file has " +
                                     std::to_string(size) + " bytes, more than lensd accepts (16 MiB)");
}

}  // namespace lensd::drivers::aravis
