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
#include <string_view>
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

constexpr std::size_t kMostAsked = 512;  ///< bytes that are asked for at once, at most
constexpr std::array<std::uint32_t, 2> kPlacesOfFile = {0x0200, 0x0400};

/// Whether that is READMEM_ACK to this question, with as many bytes.
bool IsMemory(std::string_view packet, std::string_view question) {
  constexpr char kMemory = static_cast<char>(0x85);
  return packet.size() >= kHeader && packet[2] == 0 && packet[3] == kMemory &&
         packet.substr(6, 2) == question.substr(6, 2);
}

/// READMEM_CMD, which needs no control of the camera. Empty: no answer, or no such memory.
std::string AskMemory(int socket, std::uint32_t address, std::size_t count, std::uint16_t number) {
  if (socket < 0) return "";
  constexpr char kReadMemory = static_cast<char>(0x84);
  std::string question = {0x42, 0x01, 0x00, kReadMemory, 0x00, 0x08};
  for (const int shift : {8, 0}) question += static_cast<char>(number >> shift);
  for (const int shift : {24, 16, 8, 0}) question += static_cast<char>(address >> shift);
  question += {0x00, 0x00, static_cast<char>(count >> 8), static_cast<char>(count)};
  for (int i = 0; i < kTries; ++i) {
    if (send(socket, question.data(), question.size(), MSG_NOSIGNAL) < 0) return "";
    const Instant deadline = std::chrono::steady_clock::now() + kEachTry;
    for (Duration left = kEachTry; left > Duration{}; left = deadline - std::chrono::steady_clock::now()) {
      pollfd ready{.fd = socket, .events = POLLIN, .revents = 0};
      if (poll(&ready, 1, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count())) <= 0) break;
      std::array<char, 1024> packet{};
      const ssize_t size = recv(socket, packet.data(), packet.size(), 0);
      if (size < 0 || !IsMemory({packet.data(), static_cast<std::size_t>(size)}, question)) continue;
      constexpr std::size_t kData = kHeader + 4;
      if (packet[0] != 0 || packet[1] != 0 || static_cast<std::size_t>(size) < kData + count) return "";
      return {packet.data() + kData, count};
    }
  }
  return "";
}

/// Of "Local:camera.xml;8000;1a2b?SchemaVersion=1.1.0"; 0 where it states none.
struct Extent {
  std::uint64_t address = 0, size = 0;  ///< bytes
};

Extent ExtentOf(const std::string& place) {
  const std::size_t first = place.find(';');
  const std::size_t second = first == std::string::npos ? first : place.find(';', first + 1);
  if (second == std::string::npos) return {};
  return {.address = std::strtoull(place.c_str() + first + 1, nullptr, 16),
          .size = std::strtoull(place.c_str() + second + 1, nullptr, 16)};
}

constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 20;

/// To the control port of that camera.
Result<void> Connect(const DatagramSocket& socket, const Route& route) {
  const sockaddr_in there = At(route.camera);
  if (socket.number >= 0 && connect(socket.number, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0)
    return {};
  return Fail(Code::Disconnected, route.camera + " cannot be reached: " + std::strerror(errno));
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

Result<std::vector<std::string>> AskForFile(const Route& route) {
  const DatagramSocket asking;
  if (auto connected = Connect(asking, route); !connected) return PassOn(connected);
  std::vector<std::string> places;
  std::uint16_t number = 1;
  for (const std::uint32_t place : kPlacesOfFile) {
    const std::string text = AskMemory(asking.number, place, kMostAsked, number++);
    if (places.empty() && text.empty()) {
      return Fail(Code::Disconnected, "the camera at " + route.camera + " does not say where its GenICam file is");
    }
    places.emplace_back(text.c_str());  // up to the first 0
    const std::uint64_t size = ExtentOf(places.back()).size;
    if (size <= kLargestFile) continue;
    return Fail(Code::Unsupported, "the camera at " + route.camera + " says that its GenICam file has " +
                                       std::to_string(size) + " bytes, more than lensd accepts (16 MiB)");
  }
  return places;
}

bool IsPacked(const std::string& place) {
  return place.substr(0, place.find(';')).ends_with(".zip");
}

Result<std::string> FetchFile(const Route& route, const std::string& place) {
  constexpr Duration kDeadline = std::chrono::seconds(10);
  const Instant deadline = std::chrono::steady_clock::now() + kDeadline;
  const DatagramSocket asking;
  if (auto connected = Connect(asking, route); !connected) return PassOn(connected);
  const Extent extent = ExtentOf(place);
  std::string bytes;
  std::uint16_t number = 1;
  while (bytes.size() < extent.size) {
    const std::size_t count = std::min<std::size_t>(kMostAsked, extent.size - bytes.size());
    const auto address = static_cast<std::uint32_t>(extent.address + bytes.size());
    const std::string block = AskMemory(asking.number, address, count, number);
    if (block.empty())
      return Fail(Code::Disconnected, "the camera at " + route.camera + " does not send its GenICam file");
    if (std::chrono::steady_clock::now() > deadline) {
      return Fail(Code::Timeout, "the camera at " + route.camera + " takes too long to send its GenICam file");
    }
    bytes += block;
    number = static_cast<std::uint16_t>(number % 0xffff + 1);  // never 0
  }
  return bytes;
}

}  // namespace lensd::drivers::aravis
