// Numbers as registers carry them. libmodbus' own helpers name their word orders wrongly (3.1.6), so these are ours.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace lensd::drivers::modbus {

/// Which half of a 32-bit number has the lower address.
enum class WordOrder { HighFirst, LowFirst };
enum class NumberType { U16, S16, U32, S32 };

/// Registers a number of that type takes.
constexpr int RegistersOf(NumberType type) {
  return type == NumberType::U16 || type == NumberType::S16 ? 1 : 2;
}

/// The least and the greatest number of a type.
constexpr std::pair<std::int64_t, std::int64_t> LimitsOf(NumberType type) {
  switch (type) {
    case NumberType::U16:
      return {0, 0xFFFF};
    case NumberType::S16:
      return {-0x8000, 0x7FFF};
    case NumberType::U32:
      return {0, 0xFFFFFFFFLL};
    case NumberType::S32:
      return {-0x80000000LL, 0x7FFFFFFFLL};
  }
  return {0, 0};
}

/// Whether `value` fits into `type`.
constexpr bool Fits(NumberType type, std::int64_t value) {
  const auto [least, most] = LimitsOf(type);
  return value >= least && value <= most;
}

/// Appends `value`, which fits, to `registers`.
inline void AppendNumber(std::vector<std::uint16_t>& registers, NumberType type, WordOrder order, std::int64_t value) {
  const auto low = static_cast<std::uint16_t>(value & 0xFFFF);
  if (RegistersOf(type) == 1) return registers.push_back(low);
  const auto high = static_cast<std::uint16_t>((value >> 16) & 0xFFFF);
  registers.push_back(order == WordOrder::HighFirst ? high : low);
  registers.push_back(order == WordOrder::HighFirst ? low : high);
}

/// The number at the beginning of `registers`, which has RegistersOf(type).
inline std::int64_t NumberAt(std::span<const std::uint16_t> registers, NumberType type, WordOrder order) {
  if (type == NumberType::U16) return registers[0];
  if (type == NumberType::S16) return static_cast<std::int16_t>(registers[0]);
  const std::uint32_t high = order == WordOrder::HighFirst ? registers[0] : registers[1];
  const std::uint32_t low = order == WordOrder::HighFirst ? registers[1] : registers[0];
  const std::uint32_t both = high << 16 | low;
  return type == NumberType::U32 ? std::int64_t{both} : std::int64_t{static_cast<std::int32_t>(both)};
}

}  // namespace lensd::drivers::modbus
