// SMBus transfers through the CP2112's HID reports, each with an end and a finite number of attempts. The caller holds
// the handle; one thread.
#include "cp2112.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <string>

namespace lensd::drivers::lensconnect {
namespace {

// Reports, AN495 section 3 to 7. Fields of several bytes are big-endian.
constexpr std::uint8_t kSmbusConfiguration = 0x06;
constexpr std::uint8_t kReadRequest = 0x10;
constexpr std::uint8_t kForceSend = 0x12;
constexpr std::uint8_t kReadResponse = 0x13;
constexpr std::uint8_t kWrite = 0x14;
constexpr std::uint8_t kStatusRequest = 0x15;
constexpr std::uint8_t kStatusResponse = 0x16;
constexpr std::uint8_t kCancel = 0x17;

constexpr std::size_t kMaxData = 61;
constexpr Duration kReply = std::chrono::milliseconds(50);  ///< the kernel's own driver waits as long for a report
constexpr Duration kQuiet = std::chrono::milliseconds(20);  ///< no late reply has been seen beyond this
constexpr int kPolls = 100;
constexpr int kQuestions = 3;    ///< for a status, where no answer comes
constexpr int kMostStray = 256;  ///< a device that talks without end is not a lens

/// 100 kHz, own address 0x40 and time-outs as the maker's software sets them, but one retry where it asks for endless
/// ones. Auto-send-read stays off (erratum E101).
constexpr std::array<std::uint8_t, 14> kConfiguration = {
    kSmbusConfiguration, 0x00, 0x01, 0x86, 0xA0, 0x40, 0x00, 0x03, 0xE8, 0x03, 0xE8, 0x00, 0x00, 0x01};

bool IsAllowed(std::uint8_t id) {
  return id == kReadRequest || id == kForceSend || id == kWrite || id == kStatusRequest || id == kCancel;
}

}  // namespace

struct Cp2112::Status {
  enum class Phase : std::uint8_t { Idle = 0, Busy = 1, Complete = 2, Failed = 3 };
  Phase phase = Phase::Idle;
  std::uint8_t detail = 0;

  /// Of Phase::Failed.
  Error ToError() const {
    switch (detail) {
      case 0:
        return {Code::Timeout, "the lens does not answer behind its USB bridge (is it powered?)"};
      case 1:
        return {Code::Busy, "the bus inside the lens is held low"};
      case 2:
        return {Code::Busy, "the bus inside the lens is taken by another master"};
      case 3:
        return {Code::Protocol, "a read from the lens broke off"};
      case 4:
        return {Code::Protocol, "a write to the lens broke off"};
      default:
        return {Code::Protocol, "the USB bridge reports an unknown failure " + std::to_string(detail)};
    }
  }
};

Cp2112::Cp2112(std::unique_ptr<Transport> transport, const Clock& clock)
    : transport_(std::move(transport)), clock_(clock) {}

Result<void> Cp2112::Configure() {
  if (auto drained = Drain(Duration::zero()); !drained) return drained;
  if (auto set = transport_->SetFeature(kConfiguration); !set) return set;
  std::array<std::uint8_t, 64> taken{kSmbusConfiguration};
  const auto count = transport_->GetFeature(taken);
  if (!count) return PassOn(count);
  // Each field that the chip dislikes is ignored for itself, silently.
  if (*count < kConfiguration.size() || !std::equal(kConfiguration.begin(), kConfiguration.end(), taken.begin())) {
    return Fail(Code::Protocol, "the USB bridge did not take its bus settings");
  }
  return {};
}

Result<void> Cp2112::Write(std::uint8_t address, std::span<const std::uint8_t> data) {
  assert(!data.empty() && data.size() <= kMaxData);
  std::array<std::uint8_t, 3 + kMaxData> report{kWrite, static_cast<std::uint8_t>(address << 1),
                                                static_cast<std::uint8_t>(data.size())};
  std::ranges::copy(data, report.begin() + 3);
  if (auto sent = Output(std::span(report).first(3 + data.size())); !sent) return sent;
  return AwaitTransfer();
}

Result<void> Cp2112::Read(std::uint8_t address, std::span<std::uint8_t> data) {
  assert(!data.empty() && data.size() <= kMaxData);
  const auto length = static_cast<std::uint8_t>(data.size());
  const std::array<std::uint8_t, 4> request{kReadRequest, static_cast<std::uint8_t>(address << 1), 0, length};
  if (auto sent = Output(request); !sent) return sent;
  if (auto done = AwaitTransfer(); !done) return done;
  // What lies in the queue now is not the answer to a question not yet asked.
  if (auto drained = Drain(Duration::zero()); !drained) return drained;
  const std::array<std::uint8_t, 3> force{kForceSend, 0, length};
  if (auto sent = Output(force); !sent) return sent;
  if (auto collected = Collect(data); !collected) return collected;
  // Two answers to one question: which is ours cannot be told.
  const int answers = answers_;
  if (auto drained = Drain(Duration::zero()); !drained) return drained;
  if (answers_ == answers) return {};
  return Fail(Code::Protocol, "the USB bridge answered twice; does another program use this lens?");
}

Result<void> Cp2112::Recover() {
  const std::array<std::uint8_t, 2> cancel{kCancel, 0x01};
  if (auto sent = Output(cancel); !sent) return sent;
  return Drain(kQuiet);
}

/// The one way out.
Result<void> Cp2112::Output(std::span<const std::uint8_t> report) {
  if (!IsAllowed(report[0])) return Fail(Code::Internal, "refused to send a report that is not part of a transfer");
  if (Left() <= Duration::zero()) return Fail(Code::Timeout, "the lens did not answer in time");
  return transport_->Write(report);
}

/// Reads until nothing has come for that long.
Result<void> Cp2112::Drain(Duration quiet) {
  for (int i = 0; i < kMostStray; ++i) {
    const auto count = transport_->Read(buffer_, quiet);
    if (!count) return PassOn(count);
    if (*count == 0) return {};
    if (buffer_[0] == kReadResponse) ++answers_;
  }
  return Fail(Code::Protocol, "the USB bridge sends without being asked and does not stop");
}

/// The next report of that number; others were meant for another program or come too late.
Result<std::span<const std::uint8_t>> Cp2112::Await(std::uint8_t id, Duration patience) {
  const Instant until = std::min(deadline_, clock_.Now() + patience);
  for (int i = 0; i < kMostStray; ++i) {
    const Duration left = until - clock_.Now();
    if (left <= Duration::zero()) break;
    const auto count = transport_->Read(buffer_, left);
    if (!count) return PassOn(count);
    if (*count > 0 && buffer_[0] == id) return std::span<const std::uint8_t>(buffer_, *count);
  }
  return Fail(Code::Timeout, "the USB bridge of the lens does not answer");
}

Result<Cp2112::Status> Cp2112::AskStatus() {
  const std::array<std::uint8_t, 2> request{kStatusRequest, 0x01};
  if (auto sent = Output(request); !sent) return PassOn(sent);
  const auto reply = Await(kStatusResponse, kReply);
  if (!reply) return PassOn(reply);
  if (reply->size() < 3 || (*reply)[1] > 3) return Fail(Code::Protocol, "the USB bridge sent a status of no meaning");
  return Status{static_cast<Status::Phase>((*reply)[1]), (*reply)[2]};
}

/// "Complete" is told once; an idle bridge may have told it in a report that was lost. Reads are judged by what they
/// bring, writes by what the lens then does.
Result<void> Cp2112::AwaitTransfer() {
  int unanswered = 0;
  for (int i = 0; i < kPolls; ++i) {
    const auto status = AskStatus();
    if (!status && status.error().code == Code::Timeout && ++unanswered < kQuestions) continue;
    if (!status) return PassOn(status);
    if (status->phase == Status::Phase::Failed) return PassOn(status->ToError());
    if (status->phase != Status::Phase::Busy) return {};
  }
  return Fail(Code::Timeout, "the USB bridge of the lens stays busy");
}

Result<void> Cp2112::Collect(std::span<std::uint8_t> data) {
  std::size_t filled = 0;
  while (filled < data.size()) {
    const auto reply = Await(kReadResponse, kReply);
    if (!reply) return PassOn(reply);
    if (reply->size() < 3) return Fail(Code::Protocol, "the USB bridge sent a cut-off answer");
    const std::size_t count = (*reply)[2];
    // The status byte may say idle already (it was told before): the length decides.
    if (count == 0 || count > data.size() - filled || count > reply->size() - 3) {
      return Fail(Code::Protocol, "the USB bridge sent an answer of the wrong length");
    }
    std::ranges::copy(reply->subspan(3, count), data.begin() + static_cast<std::ptrdiff_t>(filled));
    filled += count;
  }
  return {};
}

}  // namespace lensd::drivers::lensconnect
