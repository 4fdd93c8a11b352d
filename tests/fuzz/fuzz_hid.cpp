// A LensConnect bridge that answers anything at all: every transfer ends in time, nothing but the reports of a transfer
// is sent (others reset the chip or burn its memory), and a text that is read can be printed.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>

#include "registers.h"

namespace {

using namespace lensd;
using namespace lensd::drivers::lensconnect;

/// Answers from the fuzzer's bytes: a length, then a report. Waiting takes the clock's time.
class AnyBridge final : public Transport {
 public:
  AnyBridge(SteppedClock& clock, std::span<const std::uint8_t> bytes) : clock_(clock), bytes_(bytes) {}

  Result<void> Write(std::span<const std::uint8_t> report) override {
    constexpr std::uint8_t kTransfers[] = {0x10, 0x12, 0x14, 0x15, 0x17};
    if (report.empty() || report.size() > 64 || std::ranges::find(kTransfers, report[0]) == std::end(kTransfers))
      __builtin_trap();
    clock_.Advance(std::chrono::microseconds(500));
    return {};
  }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    if (bytes_.empty() || bytes_[0] == 0) {
      if (!bytes_.empty()) bytes_ = bytes_.subspan(1);
      clock_.Advance(std::max(patience, Duration(std::chrono::microseconds(100))));
      return 0;
    }
    clock_.Advance(std::chrono::microseconds(200));
    return Next(buffer);
  }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override {
    if (report.empty() || report[0] != 0x06) __builtin_trap();
    std::ranges::copy(report.first(std::min<std::size_t>(report.size(), 64)), configuration_);
    return {};
  }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override {
    if (!bytes_.empty() && bytes_[0] == 1) return Next(buffer);
    std::ranges::copy(std::span(configuration_).first(std::min<std::size_t>(buffer.size(), 64)), buffer.begin());
    return std::min<std::size_t>(buffer.size(), 64);
  }
  void Interrupt() override {}
  void BeginCall() override {}

 private:
  std::size_t Next(std::span<std::uint8_t> buffer) {
    const std::size_t length = std::min({std::size_t{bytes_[0]}, bytes_.size() - 1, buffer.size()});
    std::ranges::copy(bytes_.subspan(1, length), buffer.begin());
    bytes_ = bytes_.subspan(1 + length);
    return length;
  }

  SteppedClock& clock_;
  std::span<const std::uint8_t> bytes_;
  std::uint8_t configuration_[64] = {};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr Duration kCall = std::chrono::milliseconds(200);
  SteppedClock clock;
  Registers registers(std::make_unique<AnyBridge>(clock, std::span(data, size)), clock);
  registers.BeginCall(clock.Now() + kCall);
  if (!registers.Open()) return 0;
  for (int call = 0; call < 8; ++call) {
    const Instant began = clock.Now();
    registers.BeginCall(began + kCall);
    if (call % 3 == 0) {
      [[maybe_unused]] const auto status = registers.Read(address::kStatus1);
    } else if (call % 3 == 1) {
      const auto text = registers.ReadText(address::kModelName, 24);
      if (text && !std::ranges::all_of(*text, [](unsigned char c) { return c >= 0x20 && c < 0x7F; })) __builtin_trap();
    } else {
      [[maybe_unused]] const auto written = registers.Write(0x2000 + address::kPosition, 1000);
    }
    // Beyond its end a call may take what it waits for after a failure.
    if (clock.Now() - began > 2 * kCall) __builtin_trap();
  }
  return 0;
}
