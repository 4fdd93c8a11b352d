// A LensConnect lens behind its CP2112 as the reports on the wire show it, faults included. Time comes from outside;
// nothing here sleeps.
#include <algorithm>
#include <utility>

#include "sim/devices/lensconnect.h"

namespace lensd::sim::devices {
namespace {

constexpr std::uint8_t kLensAddress = 0x40;
constexpr std::size_t kReportSize = 64;
constexpr std::size_t kChunk = 61;

std::uint16_t Big(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint16_t>(bytes[0] << 8 | bytes[1]);
}

void Append(LensConnect::Report& report, std::uint16_t value) {
  report.push_back(static_cast<std::uint8_t>(value >> 8));
  report.push_back(static_cast<std::uint8_t>(value));
}

LensConnect::Report DefaultConfiguration() {
  return {0x06, 0x00, 0x01, 0x86, 0xA0, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
}

}  // namespace

LensConnect::LensConnect(LensConnectTraits traits, const Clock& clock)
    : traits_(std::move(traits)), clock_(clock), configuration_(DefaultConfiguration()) {
  for (const auto& motor : traits_.motors) motors_.emplace_back(motor);
}

// ---- the bridge ---------------------------------------------------------------------------------------------------

void LensConnect::Output(std::span<const std::uint8_t> report) {
  if (report.size() < 2) return;
  const auto is_one = [&] { return report[1] == 0x01; };
  switch (report[0]) {
    case 0x10: {  // read request: address, length
      const std::size_t length = report.size() >= 4 ? Big(report.subspan(2)) : 0;
      if (length < 1 || length > 512 || (report[1] & 1) != 0) return;
      read_buffer_.clear();
      if (report[1] != kLensAddress || Spoils(LensConnectFault::Nack)) return StartTransfer(Phase::Failed, 0, 0);
      for (std::size_t i = 0; i < length; ++i) read_buffer_.push_back(Byte(static_cast<std::uint16_t>(pointer_ + i)));
      return StartTransfer(Phase::Complete, 5, static_cast<std::uint16_t>(length));
    }
    case 0x12:  // force send: length
      if (report.size() >= 3) SendData(Big(report.subspan(1)));
      return;
    case 0x14: {  // write: address, count, data
      const std::size_t count = report.size() >= 3 ? report[2] : 0;
      if (count < 1 || count > kChunk || report.size() < 3 + count || (report[1] & 1) != 0) return;
      if (report[1] != kLensAddress || Spoils(LensConnectFault::Nack)) return StartTransfer(Phase::Failed, 0, 0);
      SmbusWrite(report.subspan(3, count));
      return StartTransfer(Phase::Complete, 5, static_cast<std::uint16_t>(count));
    }
    case 0x15:
      if (is_one()) SendStatus();
      return;
    case 0x17:
      if (!is_one()) return;
      transfer_.phase = Phase::Idle;
      transfer_.hangs = false;
      read_buffer_.clear();
      return;
    default:
      return;
  }
}

void LensConnect::StartTransfer(Phase end, std::uint8_t detail, std::uint16_t bytes) {
  transfer_.phase = Phase::Busy;
  transfer_.end = end;
  transfer_.detail = detail;
  transfer_.count = bytes;
  transfer_.polls_left = traits_.busy_polls;
  transfer_.hangs = Spoils(LensConnectFault::Hang);
}

/// "Complete" and "failed" are told once.
void LensConnect::SendStatus() {
  if (transfer_.phase == Phase::Busy && !transfer_.hangs && transfer_.polls_left-- <= 0)
    transfer_.phase = transfer_.end;
  const bool ended = transfer_.phase == Phase::Complete || transfer_.phase == Phase::Failed;
  Report report{0x16, static_cast<std::uint8_t>(transfer_.phase),
                static_cast<std::uint8_t>(ended ? transfer_.detail : 0)};
  Append(report, 0);
  Append(report, ended ? transfer_.count : 0);
  if (ended) transfer_.phase = Phase::Idle;
  Send(std::move(report));
}

/// At most what is there; nothing at all where nothing is.
void LensConnect::SendData(std::size_t length) {
  if (transfer_.hangs) return;
  std::size_t left = std::min(length, read_buffer_.size());
  if (left > 1 && Spoils(LensConnectFault::ShortReply)) --left;
  std::size_t sent = 0;
  while (sent < left) {
    const std::size_t count = std::min(kChunk, left - sent);
    Report report{0x13, static_cast<std::uint8_t>(transfer_.phase), static_cast<std::uint8_t>(count)};
    const auto first = read_buffer_.begin() + static_cast<std::ptrdiff_t>(sent);
    report.insert(report.end(), first, first + static_cast<std::ptrdiff_t>(count));
    Send(std::move(report));
    sent += count;
  }
  read_buffer_.clear();
}

void LensConnect::Send(Report report) {
  const Instant now = clock_.Now();
  if (Spoils(LensConnectFault::StrayReply)) Queue(Stray(), now);
  if (Spoils(LensConnectFault::LostReply)) return;
  Queue(std::move(report), Spoils(LensConnectFault::LateReply) ? now + traits_.late_by : now);
}

void LensConnect::Queue(Report report, Instant due) {
  report.resize(kReportSize);
  input_.emplace(due, std::move(report));
}

/// Answers that a client hopes for: there already, nothing busy, complete.
LensConnect::Report LensConnect::Stray() {
  switch (counts_.strays++ % 3) {
    case 0: {
      Report report{0x13, 0x02, 0x02};
      Append(report, last_target_);
      return report;
    }
    case 1:
      return {0x13, 0x02, 0x02, 0x00, 0x00};
    default:
      return {0x16, 0x02, 0x05, 0x00, 0x00, 0x00, 0x02};
  }
}

std::optional<LensConnect::Report> LensConnect::TakeInput() {
  if (input_.empty() || input_.begin()->first > clock_.Now()) return std::nullopt;
  Report report = std::move(input_.begin()->second);
  input_.erase(input_.begin());
  return report;
}

std::optional<Instant> LensConnect::NextInput() const {
  return input_.empty() ? std::nullopt : std::optional(input_.begin()->first);
}

bool LensConnect::Spoils(LensConnectFault fault) {
  const auto found = spoiled_.find(fault);
  if (found == spoiled_.end() || found->second == 0) return false;
  --found->second;
  return true;
}

// ---- feature reports ----------------------------------------------------------------------------------------------

void LensConnect::SetFeature(std::span<const std::uint8_t> report) {
  if (report.empty()) return;
  if (report[0] == 0x01 && report.size() > 1 && report[1] == 0x01) return ResetChip();
  if (report[0] >= 0x20 && report[0] <= 0x24) ++counts_.forbidden;
  if (report[0] != 0x06 || report.size() < configuration_.size()) return;
  // Each field for itself: what the chip dislikes keeps its old value.
  const auto take = [&](std::size_t at, std::size_t size, bool good) {
    if (good)
      std::copy_n(report.begin() + static_cast<std::ptrdiff_t>(at), size,
                  configuration_.begin() + static_cast<std::ptrdiff_t>(at));
  };
  take(1, 4, std::any_of(report.begin() + 1, report.begin() + 5, [](std::uint8_t byte) { return byte != 0; }));
  take(5, 1, (report[5] & 1) == 0);
  take(6, 1, report[6] <= 1);
  take(7, 2, Big(report.subspan(7)) <= 1000);
  take(9, 2, Big(report.subspan(9)) <= 1000);
  take(11, 1, report[11] <= 1);
  take(12, 2, Big(report.subspan(12)) <= 1000);
}

LensConnect::Report LensConnect::GetFeature(std::uint8_t id) {
  switch (id) {
    case 0x01:
      ResetChip();  // erratum E110
      return {0x01, 0x00};
    case 0x02:
      return {0x02, 0x00, 0x00, 0x00, 0x00};
    case 0x05:
      return {0x05, 0x0C, 0x02};
    case 0x06:
      return configuration_;
    case 0x20:
      return {0x20, 0xFF};
    default:
      return {};
  }
}

void LensConnect::ResetChip() {
  ++counts_.resets;
  configuration_ = DefaultConfiguration();
  transfer_.phase = Phase::Idle;
  read_buffer_.clear();
  input_.clear();
}

// ---- the lens -----------------------------------------------------------------------------------------------------

void LensConnect::SmbusWrite(std::span<const std::uint8_t> data) {
  if (data.size() < 2) return;
  pointer_ = Big(data);
  if (data.size() == 4) WriteRegister(pointer_, Big(data.subspan(2)));
  if (data.size() > 2 && pointer_ >= 0xFF00) ++counts_.forbidden;
}

void LensConnect::WriteRegister(std::uint16_t where, std::uint16_t value) {
  const std::size_t index = static_cast<std::size_t>(where >> 12) - 1;
  if (where < 0x1000 || index >= motors_.size() || !motors_[index].traits().present) return;
  LensConnectMotor& motor = motors_[index];
  switch (where & 0x0FFF) {
    case 0x00:
      return Start(index, false, value);
    case 0x04:
      if (value == 0x0001) motor.Stop(clock_.Now());
      return;
    case 0x08:
      if (value == 0x0001) Start(index, true, value);
      return;
    case 0x1A:
      return motor.SetSpeed(value);
    default:
      return;
  }
}

/// One motor at a time: the maker's software never asks for more.
void LensConnect::Start(std::size_t index, bool home, std::uint16_t value) {
  ++counts_.starts;
  const Instant now = clock_.Now();
  bool overlaps = false;
  for (std::size_t i = 0; i < motors_.size(); ++i) overlaps |= i != index && motors_[i].Busy(now);
  if (overlaps) ++counts_.overlaps;
  if (!home) last_target_ = value;
  if (overlaps || Spoils(LensConnectFault::Ignored)) return;
  home ? motors_[index].Home(now) : motors_[index].Move(value, now);
}

void LensConnect::LosePower() {
  for (auto& motor : motors_) motor.LosePower(clock_.Now());
}

std::uint16_t LensConnect::Register(std::uint16_t where) const {
  const Instant now = clock_.Now();
  std::uint16_t present = 0, busy = 0, lost = 0;
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    if (!motors_[i].traits().present) continue;
    const auto mask = static_cast<std::uint16_t>(0x0002 << i);
    present |= mask;
    busy |= motors_[i].Busy(now) ? mask : 0;
    lost |= motors_[i].NeedsHome(now) ? mask : 0;
  }
  switch (where) {
    case 0x0000:
      return 0x0100;
    case 0x0004:
      return 0x0203;
    case 0x0040:
      return present;
    case 0x0042:
      return busy;
    case 0x0044:
      return lost;
    case 0x0046:
      return traits_.kelvin;
    default:
      break;
  }
  const std::size_t index = static_cast<std::size_t>(where >> 12) - 1;
  return where >= 0x1000 && index < motors_.size() ? MotorRegister(motors_[index], where & 0x0FFF) : 0;
}

std::uint16_t LensConnect::MotorRegister(const LensConnectMotor& motor, std::uint16_t offset) const {
  const LensConnectMotorTraits& traits = motor.traits();
  switch (offset) {
    case 0x00:
      return motor.Position(clock_.Now());
    case 0x10:
      return traits.home_position;
    case 0x12:
      return traits.mechanical_minimum;
    case 0x14:
      return traits.mechanical_maximum;
    case 0x16:
      return traits.optical_minimum;
    case 0x18:
      return traits.optical_maximum;
    case 0x1A:
      return motor.speed();
    case 0x1C:
      return traits.speed_minimum;
    case 0x1E:
      return traits.speed_maximum;
    default:
      return 0;
  }
}

std::uint8_t LensConnect::Byte(std::uint16_t where) const {
  if (where >= 0x0010 && where < 0x0028) {
    const std::size_t at = where - 0x0010u;
    return at < traits_.model.size() ? static_cast<std::uint8_t>(traits_.model[at]) : 0;
  }
  const std::uint16_t word = Register(where & 0xFFFE);
  return static_cast<std::uint8_t>((where & 1) == 0 ? word >> 8 : word);
}

}  // namespace lensd::sim::devices
