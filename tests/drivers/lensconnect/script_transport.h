// A transport that plays a script: what the driver must send, byte for byte, and what comes back.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <string>
#include <vector>

#include "base/clock.h"
#include "transport.h"

namespace lensd::testing {

using Bytes = std::vector<std::uint8_t>;

/// "14 40 02 00 40".
inline Bytes FromHex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 3) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// Shared between test and transport.
struct Script {
  struct Step {
    Bytes sent;
    std::vector<Bytes> replies;
  };
  std::deque<Step> steps;
  std::deque<Bytes> input;  ///< waiting to be read, before the first step too
  Bytes feature;            ///< what the bridge says its settings are; empty: what it was told
  int unexpected = 0;

  void Expect(const std::string& sent, const std::vector<std::string>& replies = {}) {
    Step step{FromHex(sent), {}};
    for (const auto& reply : replies) step.replies.push_back(FromHex(reply));
    steps.push_back(std::move(step));
  }
};

class ScriptTransport final : public drivers::lensconnect::Transport {
 public:
  ScriptTransport(std::shared_ptr<Script> script, SteppedClock& clock) : script_(std::move(script)), clock_(clock) {}

  Result<void> Write(std::span<const std::uint8_t> report) override { return Meet(report); }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override {
    told_.assign(report.begin(), report.end());
    return Meet(report);
  }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override {
    EXPECT_EQ(buffer[0], 0x06) << "only the bus settings may be read: reading 0x01 resets the chip (erratum E110)";
    const Bytes& answer = script_->feature.empty() ? told_ : script_->feature;
    std::ranges::copy(answer, buffer.begin());
    return answer.size();
  }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    if (script_->input.empty()) {
      clock_.Advance(patience);
      return std::size_t{0};
    }
    const Bytes report = script_->input.front();
    script_->input.pop_front();
    std::ranges::copy(report, buffer.begin());
    return report.size();
  }
  void Interrupt() override {}
  void BeginCall() override {}

 private:
  Result<void> Meet(std::span<const std::uint8_t> report) {
    const Bytes sent(report.begin(), report.end());
    if (script_->steps.empty()) {
      ++script_->unexpected;
      ADD_FAILURE() << "sent beyond the script: " << ::testing::PrintToString(sent);
      return Fail(Code::Protocol, "beyond the script");
    }
    const auto step = std::move(script_->steps.front());
    script_->steps.pop_front();
    EXPECT_EQ(sent, step.sent);
    for (const Bytes& reply : step.replies) script_->input.push_back(reply);
    return {};
  }

  std::shared_ptr<Script> script_;
  SteppedClock& clock_;
  Bytes told_;
};

}  // namespace lensd::testing
