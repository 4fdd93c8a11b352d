// A transport that expects exactly these transfers, byte for byte, and answers as it is told.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "transport.h"

namespace lensd::drivers::uvc {

using Bytes = std::vector<std::uint8_t>;

/// "21 01 00 08"
inline Bytes FromHex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 3) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

class ScriptedTransport final : public Transport {
 public:
  explicit ScriptedTransport(SteppedClock& clock) : clock_(clock) {}
  ~ScriptedTransport() override { EXPECT_TRUE(script_.empty()) << script_.size() << " expected transfers never came"; }

  /// A reading, answered with `data`.
  void ExpectIn(const std::string& setup, const std::string& data) {
    script_.push_back({FromHex(setup), {}, {Reply::Outcome::Done, FromHex(data)}});
  }
  /// A setting, acknowledged.
  void ExpectOut(const std::string& setup, const std::string& data) {
    script_.push_back({FromHex(setup), FromHex(data), {}});
  }
  /// Either, with another outcome.
  void ExpectFailing(const std::string& setup, const std::string& data, Reply::Outcome outcome) {
    script_.push_back({FromHex(setup), FromHex(data), {outcome, {}}});
  }
  void QueueStatus(const std::string& packet) { status_.push_back(FromHex(packet)); }
  bool done() const { return script_.empty(); }

  Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration) override {
    const auto bytes = setup.Bytes();
    if (script_.empty()) {
      ADD_FAILURE() << "unexpected transfer " << ::testing::PrintToString(bytes);
      return {Reply::Outcome::Failed, {}};
    }
    const Step step = std::move(script_.front());
    script_.pop_front();
    EXPECT_EQ(Bytes(bytes.begin(), bytes.end()), step.setup);
    EXPECT_EQ(Bytes(out.begin(), out.end()), step.out);
    if (step.reply.outcome == Reply::Outcome::Gone) gone_ = true;
    return step.reply;
  }
  void WaitUntil(Instant until) override { clock_.AdvanceTo(until); }
  std::vector<Bytes> TakeStatus() override { return std::exchange(status_, {}); }
  Result<void> StartStream(const StreamPipe& pipe, PayloadSink& sink) override {
    pipe_ = pipe;
    sink_ = &sink;
    return {};
  }
  void StopStream() override { sink_ = nullptr; }
  bool Gone() const override { return gone_; }
  void BeginCall() override {}
  void Interrupt() override {}

  StreamPipe pipe_;
  PayloadSink* sink_ = nullptr;

 private:
  struct Step {
    Bytes setup;
    Bytes out;
    Reply reply;
  };
  SteppedClock& clock_;
  std::deque<Step> script_;
  std::vector<Bytes> status_;
  bool gone_ = false;
};

}  // namespace lensd::drivers::uvc
