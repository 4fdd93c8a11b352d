// USB/IP as vhci_hcd speaks it (kernel documentation, usb/usbip_protocol): requests of the host and answers to them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"

namespace lensd::sim::devices::usbip {

/// What the kernel asks for.
struct Command {
  bool unlink = false;
  std::uint32_t sequence = 0;
  bool in = false;
  std::uint32_t endpoint = 0;
  std::uint32_t length = 0;  ///< of the buffer
  std::array<std::uint8_t, 8> setup{};
  std::vector<std::uint8_t> out;              ///< data of an OUT transfer
  std::vector<std::uint32_t> packet_lengths;  ///< isochronous: room in each packet
  std::uint32_t unlinked = 0;                 ///< of which sequence number
};

inline constexpr std::int32_t kStalled = -32;    // -EPIPE
inline constexpr std::int32_t kUnlinked = -104;  // -ECONNRESET

/// Reads one command, waiting for all of it. Disconnected: the other end is closed. Protocol.
Result<Command> ReadCommand(int socket);

/// Ends a transfer that is not isochronous. `data`: of an IN transfer; `length`: what was taken of an OUT one.
Result<void> Answer(int socket, const Command& to, std::int32_t status, std::span<const std::uint8_t> data);
/// Ends an isochronous IN transfer: one payload a packet, fewer than packets where there are no more.
Result<void> AnswerPackets(int socket, const Command& to, std::span<const std::vector<std::uint8_t>> payloads);
/// Answers an unlink command. `found`: the transfer had not ended yet.
Result<void> AnswerUnlink(int socket, const Command& to, bool found);

/// Attaches the other end of a new socket pair to a free high-speed port of vhci_hcd; returns this end. Io, Timeout.
Result<int> Attach();

}  // namespace lensd::sim::devices::usbip
