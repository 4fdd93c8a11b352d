// What a drive may do on its bus.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "profile.h"

namespace lensd::drivers::modbus {

/// The bus' thread only. Every call is one exchange (Run() one for each step) and fails with Cancelled, nothing sent,
/// where a stop for this drive came in between or the order was withdrawn.
class RegisterAccess {
 public:
  virtual Result<void> Read(std::uint16_t address, std::span<std::uint16_t> registers) = 0;
  virtual Result<void> Write(int function, std::uint16_t address, std::span<const std::uint16_t> registers) = 0;
  /// An answer of this drive to something older may still be under way, so that an answer proves little.
  virtual bool suspect() const = 0;

  Result<std::int64_t> ReadNumber(const Place& place, WordOrder order);
  Result<void> Run(const Sequence& sequence, const Profile& profile, std::int64_t target);

 protected:
  ~RegisterAccess() = default;
};

}  // namespace lensd::drivers::modbus
