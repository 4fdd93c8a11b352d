// Frames of Modbus, from the side that answers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lensd::sim::wire {

/// High byte first.
std::uint16_t Word(const std::vector<std::uint8_t>& bytes, std::size_t at);
void Append(std::vector<std::uint8_t>& bytes, std::uint16_t word);

/// CRC-16/MODBUS; goes onto the line low byte first.
std::uint16_t Checksum(std::span<const std::uint8_t> bytes);

/// How long the request that begins like this is on a serial line, checksum included; 0: not to be told yet; -1: no
/// function that drives have.
int RequestLength(std::span<const std::uint8_t> begin);

/// unit, function, data -> with checksum.
std::vector<std::uint8_t> Rtu(std::vector<std::uint8_t> frame);

}  // namespace lensd::sim::wire
