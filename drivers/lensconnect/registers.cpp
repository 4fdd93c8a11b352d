// Register access over SMBus with a budget for a whole call, so that retries cannot outlast the I/O deadline. Only
// registers that may be written are.
#include "registers.h"

#include <algorithm>
#include <vector>

namespace lensd::drivers::lensconnect {
namespace {

constexpr std::uint8_t kLens = 0x20;  ///< 7 bits; 0x40 in reports
constexpr int kAttempts = 3;

bool IsTransient(Code code) {
  return code == Code::Timeout || code == Code::Protocol || code == Code::Busy;
}

bool MayWrite(std::uint16_t where) {
  constexpr std::array kWritable = {address::kPosition, address::kStop, address::kBacklashCancel, address::kInitialize,
                                    address::kSpeed};
  return std::ranges::any_of(kMotors, [&](const Motor& motor) {
    return where >= motor.base && std::ranges::find(kWritable, where - motor.base) != kWritable.end();
  });
}

}  // namespace

void Registers::BeginCall(Instant deadline) {
  bridge_.SetDeadline(deadline);
  bridge_.transport().BeginCall();
}

template <class Once>
Result<void> Registers::Attempt(Once once, const std::function<bool()>& obeyed) {
  Result<void> done;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (std::exchange(unsure_, false)) {
      if (done = bridge_.Recover(); !done) {
        if (IsBusError(done.error().code)) ++errors_;
        unsure_ = true;
        return done;
      }
      if (attempt > 0 && obeyed && obeyed()) return {};
    }
    if (done = once(); done) return done;
    unsure_ = true;
    if (IsBusError(done.error().code)) ++errors_;
    if (!IsTransient(done.error().code)) break;
  }
  return done;
}

/// The address is written first; the read follows by itself (no repeated start: errata E101, E104).
Result<void> Registers::ReadOnce(std::uint16_t where, std::span<std::uint8_t> data) {
  const std::array<std::uint8_t, 2> pointer{static_cast<std::uint8_t>(where >> 8), static_cast<std::uint8_t>(where)};
  if (auto written = bridge_.Write(kLens, pointer); !written) return written;
  return bridge_.Read(kLens, data);
}

Result<std::uint16_t> Registers::Read(std::uint16_t where) {
  std::array<std::uint8_t, 2> data{};
  if (auto read = Attempt([&] { return ReadOnce(where, data); }, {}); !read) return PassOn(read);
  return static_cast<std::uint16_t>(data[0] << 8 | data[1]);
}

Result<std::string> Registers::ReadText(std::uint16_t where, std::size_t length) {
  std::vector<std::uint8_t> data(length);
  if (auto read = Attempt([&] { return ReadOnce(where, data); }, {}); !read) return PassOn(read);
  std::string text;
  for (const std::uint8_t byte : data) {
    if (byte == 0) break;
    if (byte >= 0x20 && byte < 0x7F) text += static_cast<char>(byte);
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

Result<void> Registers::Write(std::uint16_t where, std::uint16_t value, const std::function<bool()>& obeyed) {
  if (!MayWrite(where)) return Fail(Code::Internal, "refused to write to a register that is not a motor's");
  const std::array<std::uint8_t, 4> report{static_cast<std::uint8_t>(where >> 8), static_cast<std::uint8_t>(where),
                                           static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
  return Attempt([&] { return bridge_.Write(kLens, report); }, obeyed);
}

}  // namespace lensd::drivers::lensconnect
