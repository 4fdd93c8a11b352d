// Modbus frames from the answering side: CRC, lengths, RTU. Written from the specification, apart from the driver's
// libmodbus.
#include "wire.h"

namespace lensd::sim::wire {

std::uint16_t Word(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void Append(std::vector<std::uint8_t>& bytes, std::uint16_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
}

std::uint16_t Checksum(std::span<const std::uint8_t> bytes) {
  std::uint16_t sum = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    sum ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (sum & 1) != 0;
      sum >>= 1;
      if (carry) sum ^= 0xA001;
    }
  }
  return sum;
}

int RequestLength(std::span<const std::uint8_t> begin) {
  if (begin.size() < 2) return 0;
  switch (begin[1]) {
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x04:
    case 0x05:
    case 0x06:
    case 0x08:
      return 8;
    case 0x10:
      return begin.size() < 7 ? 0 : 9 + begin[6];
    default:
      return -1;
  }
}

std::vector<std::uint8_t> Rtu(std::vector<std::uint8_t> frame) {
  const std::uint16_t sum = Checksum(frame);
  frame.push_back(static_cast<std::uint8_t>(sum & 0xFF));
  frame.push_back(static_cast<std::uint8_t>(sum >> 8));
  return frame;
}

}  // namespace lensd::sim::wire
