// USB/IP as the kernel's vhci_hcd speaks it, so that a simulated camera appears as a USB device.
#include "usbip.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>

namespace lensd::sim::devices::usbip {
namespace {

constexpr std::size_t kHeader = 48;
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinkDone = 4;
constexpr std::uint32_t kMostPackets = 1024;
constexpr std::uint32_t kMostBytes = 16u << 20;
constexpr const char* kPorts = "/sys/devices/platform/vhci_hcd.0/";

std::uint32_t Big(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | bytes[at + i];
  return value;
}

void Put(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

Result<void> ReadAll(int socket, std::span<std::uint8_t> into) {
  while (!into.empty()) {
    const ssize_t got = recv(socket, into.data(), into.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return Fail(Code::Disconnected, "the kernel closed the USB/IP connection");
    into = into.subspan(static_cast<std::size_t>(got));
  }
  return {};
}

Result<void> WriteAll(int socket, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return Fail(Code::Disconnected, "the kernel closed the USB/IP connection");
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return {};
}

std::vector<std::uint8_t> Header(std::uint32_t command, std::uint32_t sequence) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint32_t word : {command, sequence, 0u, 0u, 0u}) Put(bytes, word);
  return bytes;
}

/// Status, length, start frame, packets, errors, padding.
std::vector<std::uint8_t> Submitted(const Command& to, std::int32_t status, std::size_t length, std::size_t packets) {
  auto bytes = Header(kSubmitted, to.sequence);
  Put(bytes, static_cast<std::uint32_t>(status));
  Put(bytes, static_cast<std::uint32_t>(length));
  for (const std::size_t word : {std::size_t{0}, packets, std::size_t{0}}) Put(bytes, static_cast<std::uint32_t>(word));
  bytes.resize(kHeader);
  return bytes;
}

Result<void> ReadRest(int socket, Command& command, std::uint32_t packets) {
  if (!command.in && command.length > 0) {
    command.out.resize(command.length);
    if (auto read = ReadAll(socket, command.out); !read) return read;
  }
  std::vector<std::uint8_t> descriptors(std::size_t{16} * packets);
  if (auto read = ReadAll(socket, descriptors); !read) return read;
  for (std::size_t i = 0; i < packets; ++i) command.packet_lengths.push_back(Big(descriptors, 16 * i + 4));
  return {};
}

/// "hs  0004 004 000 00000000 000000 0-0": status 004 is a port without a device.
std::optional<int> FreePort() {
  std::ifstream file(std::string(kPorts) + "status");
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string hub, state;
    int port = 0;
    if (words >> hub >> port >> state && hub == "hs" && state == "004") return port;
  }
  return std::nullopt;
}

}  // namespace

Result<Command> ReadCommand(int socket) {
  std::array<std::uint8_t, kHeader> header{};
  if (auto read = ReadAll(socket, header); !read) return PassOn(read);
  Command command;
  const std::uint32_t kind = Big(header, 0);
  command.sequence = Big(header, 4);
  command.in = Big(header, 12) != 0;
  command.endpoint = Big(header, 16);
  if (kind == kUnlink) {
    command.unlink = true;
    command.unlinked = Big(header, 20);
    return command;
  }
  command.length = Big(header, 24);
  const std::uint32_t packets = Big(header, 32);
  if (kind != kSubmit || command.length > kMostBytes) return Fail(Code::Protocol, "not a USB/IP command");
  std::ranges::copy(std::span(header).subspan(40), command.setup.begin());
  const bool isochronous = packets > 0 && packets <= kMostPackets;
  if (auto read = ReadRest(socket, command, isochronous ? packets : 0); !read) return PassOn(read);
  return command;
}

Result<void> Answer(int socket, const Command& to, std::int32_t status, std::span<const std::uint8_t> data) {
  const std::size_t length = to.in ? std::min<std::size_t>(data.size(), to.length) : status == 0 ? to.length : 0;
  auto bytes = Submitted(to, status, length, 0);
  if (to.in) bytes.insert(bytes.end(), data.begin(), data.begin() + static_cast<std::ptrdiff_t>(length));
  return WriteAll(socket, bytes);
}

Result<void> AnswerPackets(int socket, const Command& to, std::span<const std::vector<std::uint8_t>> payloads) {
  std::size_t total = 0;
  for (const auto& payload : payloads) total += payload.size();
  auto bytes = Submitted(to, 0, total, to.packet_lengths.size());
  for (const auto& payload : payloads) bytes.insert(bytes.end(), payload.begin(), payload.end());
  std::uint32_t offset = 0;
  for (std::size_t i = 0; i < to.packet_lengths.size(); ++i) {
    const std::size_t length = i < payloads.size() ? payloads[i].size() : 0;
    Put(bytes, offset);
    Put(bytes, to.packet_lengths[i]);
    Put(bytes, static_cast<std::uint32_t>(length));
    Put(bytes, 0);
    offset += to.packet_lengths[i];
  }
  return WriteAll(socket, bytes);
}

Result<void> AnswerUnlink(int socket, const Command& to, bool found) {
  auto bytes = Header(kUnlinkDone, to.sequence);
  Put(bytes, static_cast<std::uint32_t>(found ? kUnlinked : 0));
  bytes.resize(kHeader);
  return WriteAll(socket, bytes);
}

Result<int> Attach() {
  constexpr int kHighSpeed = 3;
  constexpr int kAttempts = 250;
  std::optional<int> port = FreePort();
  // A port is free again only once the kernel has taken leave of its last device.
  for (int i = 0; !port && i < kAttempts; ++i) {
    if (access((std::string(kPorts) + "status").c_str(), R_OK) != 0) {
      return Fail(Code::Io, std::string(kPorts) + ": " + std::strerror(errno) + "; load vhci_hcd as root");
    }
    usleep(20'000);
    port = FreePort();
  }
  if (!port) return Fail(Code::Timeout, "vhci_hcd has no free high-speed port");
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return Fail(Code::Io, std::strerror(errno));
  std::ofstream attach(std::string(kPorts) + "attach");
  attach << *port << " " << ends[1] << " " << 0x10001 + *port << " " << kHighSpeed << std::flush;
  const bool attached = attach.good();
  close(ends[1]);
  if (attached) return ends[0];
  close(ends[0]);
  return Fail(Code::Io, std::string(kPorts) + "attach: " + std::strerror(errno));
}

}  // namespace lensd::sim::devices::usbip
