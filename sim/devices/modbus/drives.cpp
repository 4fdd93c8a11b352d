// What every simulated drive is made of: a file of registers with ranges, and the families by name.
#include "drives.h"

#include <algorithm>

namespace lensd::sim {

void RegisterFile::AddRange(std::uint16_t first, std::uint16_t last, Access access) {
  ranges_.push_back({first, last, access});
}

bool RegisterFile::Covered(std::uint16_t address, int count, Access access) const {
  const auto covered = [&](int at) {
    return std::ranges::any_of(
        ranges_, [&](const Stretch& range) { return at >= range.first && at <= range.last && range.access >= access; });
  };
  for (int at = address; at < address + count; ++at) {
    if (!covered(at)) return false;
  }
  return count > 0;
}

std::uint16_t RegisterFile::Get(std::uint16_t address) const {
  const auto found = values_.find(address);
  return found == values_.end() ? std::uint16_t{0} : found->second;
}

std::int32_t RegisterFile::Get32(std::uint16_t address) const {
  const std::uint32_t high = Get(address), low = Get(static_cast<std::uint16_t>(address + 1));
  return static_cast<std::int32_t>(high << 16 | low);
}

void RegisterFile::Set32(std::uint16_t address, std::int64_t value) {
  Set(address, static_cast<std::uint16_t>(value >> 16 & 0xFFFF));
  Set(static_cast<std::uint16_t>(address + 1), static_cast<std::uint16_t>(value & 0xFFFF));
}

std::expected<ModbusDrive::Registers, ModbusDrive::ExceptionCode> ModbusDrive::Read(std::uint16_t address, int count,
                                                                                    Duration now) {
  constexpr ExceptionCode kBadValue = 0x03;
  if (count < 1 || count > refusals_.most) return std::unexpected(kBadValue);
  if (!file_.Readable(address, count)) return std::unexpected(refusals_.read);
  if (now >= frozen_until_) Refresh(now);
  Registers registers;
  for (int i = 0; i < count; ++i) registers.push_back(file_.Get(static_cast<std::uint16_t>(address + i)));
  return registers;
}

std::expected<void, ModbusDrive::ExceptionCode> ModbusDrive::Write(std::uint16_t address,
                                                                   std::span<const std::uint16_t> registers,
                                                                   Duration now) {
  const Written written{address, static_cast<int>(registers.size())};
  if (!file_.Writable(address, written.count)) return std::unexpected(refusals_.write);
  if (now >= frozen_until_) Refresh(now);
  for (std::size_t i = 0; i < registers.size(); ++i) file_.Set(static_cast<std::uint16_t>(address + i), registers[i]);
  return Obey(written, now);
}

std::unique_ptr<ModbusDrive> MakeModbusDrive(std::string_view profile, double counts) {
  if (profile == "oriental-az") return MakeOrientalAz(counts);
  if (profile == "moons") return MakeMoons(counts);
  if (profile == "leadshine-rs") return MakeLeadshineRs(counts);
  if (profile == "generic") return MakeGeneric(counts);
  return nullptr;
}

}  // namespace lensd::sim
