#include <algorithm>
#include <cmath>

#include "sim/devices/modbus_drive.h"

namespace lensd::sim {
namespace {

constexpr std::uint8_t kNoSuchAddress = 0x02;
constexpr std::uint8_t kBadValue = 0x03;

// ---- Oriental Motor AZ ----------------------------------------------------------------------------------------------

/// Direct data operation at 0x0058, driver input at 0x007C (levels) and 0x0078 (pulses), output at 0x007E.
class OrientalAz final : public ModbusDrive {
 public:
  explicit OrientalAz(double counts) : ModbusDrive(counts) {
    file_.AddRange(0x0058, 0x0069, true);
    file_.AddRange(0x0078, 0x007D, true);
    for (const auto& [first, last] : {std::pair{0x007E, 0x0095},
                                      {0x00AC, 0x00AD},
                                      {0x00C6, 0x00D7},
                                      {0x00F8, 0x00FB},
                                      {0x0120, 0x0123},
                                      {0x0178, 0x017F}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), false);
    }
    file_.AddRange(0x0180, 0x018D, true);
    file_.AddRange(0x0386, 0x038B, true);
    file_.AddRange(0x1800, 0x180B, true);
  }

  std::expected<Registers, ExceptionCode> Read(std::uint16_t address, int count, Duration now) override {
    if (!file_.Readable(address, count)) return std::unexpected(kNoSuchAddress);
    Refresh(now);
    Registers registers;
    for (int i = 0; i < count; ++i) registers.push_back(file_.Get(static_cast<std::uint16_t>(address + i)));
    return registers;
  }

  std::expected<void, ExceptionCode> Write(std::uint16_t address, std::span<const std::uint16_t> registers,
                                           Duration now) override {
    const int count = static_cast<int>(registers.size());
    if (!file_.Writable(address, count)) return std::unexpected(kNoSuchAddress);
    Refresh(now);
    const std::int32_t input_before = file_.Get32(0x007C);
    const std::int32_t reset_before = file_.Get32(0x0180), preset_before = file_.Get32(0x018A);
    for (int i = 0; i < count; ++i) {
      file_.Set(static_cast<std::uint16_t>(address + i), registers[static_cast<std::size_t>(i)]);
    }
    if (address <= 0x0067 && address + count > 0x0067 && file_.Get32(0x0066) == 1) {
      Trigger(now);
      file_.Set32(0x0066, 0);  // it clears by itself
    }
    Input(input_before, file_.Get32(0x007C), now);
    if (const std::int32_t pulse = file_.Get32(0x0078); pulse != 0) {
      Input(0, pulse, now);
      file_.Set32(0x0078, 0);
    }
    if (reset_before == 0 && file_.Get32(0x0180) == 1) Reset();
    if (preset_before == 0 && file_.Get32(0x018A) == 1) Preset(now);
    return {};
  }

  void RaiseAlarm(std::uint32_t alarm, Duration now) override {
    alarm_ = alarm;
    if (alarm == 0) return;
    shaft_.StopDead(now);
    homing_ = false;
    history_.insert(history_.begin(), alarm);
    history_.resize(std::min<std::size_t>(history_.size(), 10));
  }

  void Preset(Duration now) override {
    homed_ = true;
    shaft_.Call(now, 0.0);
  }

 private:
  static constexpr std::int32_t kStart = 1 << 3, kHome = 1 << 4, kStop = 1 << 5, kFree = 1 << 6, kAlarmReset = 1 << 7;

  void Refresh(Duration now) {
    if (homing_ && !shaft_.MovingAt(now)) {
      homing_ = false;
      homed_ = true;
      shaft_.Call(now, 0.0);
    }
    const bool moving = shaft_.MovingAt(now);
    const bool held = (file_.Get32(0x007C) & (kStop | kFree)) != 0;
    std::int32_t output = 0;
    if (homed_) output |= 1 << 4;
    if (!moving && alarm_ == 0 && !held) output |= 1 << 5;
    if (alarm_ != 0) output |= 1 << 7;
    if (moving) output |= 1 << 13;
    if (!moving && (file_.Get32(0x007C) & kFree) == 0) output |= 1 << 14;
    file_.Set32(0x007E, output);
    file_.Set32(0x0080, alarm_);
    for (std::size_t i = 0; i < history_.size(); ++i)
      file_.Set32(static_cast<std::uint16_t>(0x0082 + 2 * i), history_[i]);
    const std::int64_t count = std::llround(shaft_.CountAt(now));
    const std::int64_t speed = std::llround(shaft_.SpeedAt(now));
    for (const int place : {0x00C6, 0x00CC, 0x0120, 0x0122}) file_.Set32(static_cast<std::uint16_t>(place), count);
    for (const int hertz : {0x00CA, 0x00D0}) file_.Set32(static_cast<std::uint16_t>(hertz), speed);
    file_.Set32(0x00F8, 412);
    file_.Set32(0x00FA, 385);
  }

  void Trigger(Duration now) {
    Operate(file_.Get32(0x005A), file_.Get32(0x005C), file_.Get32(0x005E), file_.Get32(0x0060), now);
  }

  /// Rates are in 0.001 kHz/s, which is 1 Hz/s.
  void Operate(std::int32_t type, double position, double speed, double rate, Duration now) {
    const bool held = (file_.Get32(0x007C) & (kStop | kFree)) != 0;
    if (alarm_ != 0 || held) return;
    if (type == 0) return shaft_.Stop(now, std::max(1.0, rate));
    if (type < 1 || type > 3 || rate <= 0 || speed <= 0) return RaiseAlarm(0x70, now);
    if (type == 1 && !homed_) return RaiseAlarm(0x4A, now);
    if (!MayBegin()) return;
    const double from = type == 1 ? 0.0 : type == 2 ? shaft_.target() : shaft_.CountAt(now);
    shaft_.MoveTo(now, from + position, speed, rate);
  }

  void Input(std::int32_t before, std::int32_t after, Duration now) {
    const std::int32_t rising = after & ~before;
    if ((rising & kAlarmReset) != 0) Reset();
    if ((rising & (kStop | kFree)) != 0) {
      NoteStop();
      homing_ = false;
      shaft_.Stop(now, file_.Get32(0x0062) > 0 ? file_.Get32(0x0062) : 1e6);
    }
    const bool held = (after & (kStop | kFree)) != 0;
    if ((rising & kHome) != 0 && !held && alarm_ == 0 && MayBegin()) {
      homing_ = true;
      homed_ = false;
      shaft_.MoveToReference(now, 20e3, 1e6);
    }
    if ((rising & kStart) != 0 && !held) {
      Operate(file_.Get32(0x1800), file_.Get32(0x1802), file_.Get32(0x1804), file_.Get32(0x1806), now);
    }
  }

  void Reset() {
    static constexpr std::uint32_t kPowerCycle[] = {0x20, 0x28, 0x2A, 0x33, 0x41, 0x42, 0x43,
                                                    0x44, 0x45, 0x71, 0x72, 0x83, 0xF0};
    if (std::ranges::find(kPowerCycle, alarm_) == std::end(kPowerCycle)) alarm_ = 0;
  }

  RegisterFile file_;
  std::uint32_t alarm_ = 0;
  std::vector<std::uint32_t> history_;
  bool homed_ = false;
  bool homing_ = false;
};

// ---- Moons'/Applied Motion ------------------------------------------------------------------------------------------

/// Opcodes at 40125. Registers that are not there answer with codes of their own.
class Moons final : public ModbusDrive {
 public:
  explicit Moons(double counts) : ModbusDrive(counts) {
    for (const auto& [first, last] : {std::pair{0, 1}, {3, 7}, {10, 15}, {111, 111}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), false);
    }
    for (const auto& [first, last] : {std::pair{27, 31}, {46, 48}, {124, 129}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), true);
    }
    shaft_.Call(Duration{}, 0.0);  // it counts from where it was switched on
    for (const auto& [address, value] : {std::pair{27, 600}, {28, 600}, {29, 240}}) {
      file_.Set(static_cast<std::uint16_t>(address), static_cast<std::uint16_t>(value));
    }
  }

  std::expected<Registers, ExceptionCode> Read(std::uint16_t address, int count, Duration now) override {
    if (count < 1 || count > 50) return std::unexpected(kBadValue);
    if (!file_.Readable(address, count)) return std::unexpected(std::uint8_t{0x11});
    Refresh(now);
    Registers registers;
    for (int i = 0; i < count; ++i) registers.push_back(file_.Get(static_cast<std::uint16_t>(address + i)));
    return registers;
  }

  std::expected<void, ExceptionCode> Write(std::uint16_t address, std::span<const std::uint16_t> registers,
                                           Duration now) override {
    const int count = static_cast<int>(registers.size());
    if (!file_.Writable(address, count)) return std::unexpected(std::uint8_t{0x12});
    Refresh(now);
    for (int i = 0; i < count; ++i) {
      file_.Set(static_cast<std::uint16_t>(address + i), registers[static_cast<std::size_t>(i)]);
    }
    if (address <= 124 && address + count > 124) return Execute(file_.Get(124), now);
    return {};
  }

  void RaiseAlarm(std::uint32_t alarm, Duration now) override {
    alarm_ = alarm;
    if (alarm != 0) {
      shaft_.StopDead(now);
      homing_ = false;
      enabled_ = false;
    }
  }

 private:
  void Refresh(Duration now) {
    const bool moving = shaft_.MovingAt(now);
    if (!moving) homing_ = jogging_ = false;
    int status = 0;
    if (enabled_) status |= 1 << 0;
    if (alarm_ != 0) status |= 1 << 2;
    if (!moving) status |= 1 << 3;
    if (moving) status |= 1 << 4;
    if (jogging_) status |= 1 << 5;
    if (homing_) status |= 1 << 10;
    file_.Set(0, static_cast<std::uint16_t>(alarm_));
    file_.Set(1, static_cast<std::uint16_t>(status));
    file_.Set(111, static_cast<std::uint16_t>(alarm_ >> 16));
    const double count = std::round(shaft_.CountAt(now));
    file_.Set32(4, std::llround(count - encoder_zero_));
    file_.Set32(6, std::llround(count));
    file_.Set(12, 415);
    file_.Set(13, 240);
  }

  std::expected<void, ExceptionCode> Execute(std::uint16_t opcode, Duration now) {
    switch (opcode) {
      case 0xBA:
        alarm_ = 0;
        return {};
      case 0x9F:
        enabled_ = alarm_ == 0;
        return {};
      case 0x9E:
        enabled_ = false;
        shaft_.StopDead(now);
        return {};
      case 0x66:
      case 0x67:
        Move(opcode == 0x67 ? 0.0 : shaft_.CountAt(now), now);
        return {};
      case 0x96:
        if (Ready(now)) {
          jogging_ = true;
          shaft_.MoveTo(now, 1e9, Speed(), Acceleration());
        }
        return {};
      case 0xD8:
      case 0xE1:
      case 0xE2:
        NoteStop();
        homing_ = false;
        shaft_.Stop(now, opcode == 0xE1 ? 1e7 : Acceleration());
        return {};
      case 0xA5:
        encoder_zero_ += file_.Get32(125) - std::round(shaft_.CountAt(now));
        shaft_.Call(now, file_.Get32(125));
        return {};
      case 0x98:
        encoder_zero_ = std::round(shaft_.CountAt(now)) - file_.Get32(125);
        return {};
      case 0x6E:
        return SeekHome(now);
      default:
        return std::unexpected(std::uint8_t{0x13});
    }
  }

  bool Ready(Duration now) {
    if (!enabled_) alarm_ |= 1u << 12;
    return enabled_ && alarm_ == 0 && !shaft_.MovingAt(now) && MayBegin();
  }

  /// A move commanded in mid motion is not begun.
  void Move(double from, Duration now) {
    if (Ready(now)) shaft_.MoveTo(now, from + file_.Get32(30), Speed(), Acceleration());
  }

  std::expected<void, ExceptionCode> SeekHome(Duration now) {
    const int condition = file_.Get(126);
    if (condition != 'L' && condition != 'H' && condition != 'R' && condition != 'F') {
      return std::unexpected(std::uint8_t{0x13});
    }
    if (!Ready(now)) return {};
    homing_ = true;
    shaft_.MoveToReference(now, Speed(), Acceleration());
    return {};
  }

  static constexpr double kCountsPerRevolution = 20000.0;
  double Speed() const { return file_.Get(29) / 240.0 * kCountsPerRevolution; }
  double Acceleration() const { return std::max(1.0, file_.Get(27) / 6.0 * kCountsPerRevolution); }

  RegisterFile file_;
  std::uint32_t alarm_ = 0;
  bool enabled_ = true;
  bool homing_ = false;
  bool jogging_ = false;
  double encoder_zero_ = 0.0;
};

// ---- Leadshine RS ---------------------------------------------------------------------------------------------------

/// PR paths at 0x6200, trigger at 0x6002.
class LeadshineRs final : public ModbusDrive {
 public:
  explicit LeadshineRs(double counts) : ModbusDrive(counts) {
    file_.AddRange(0x6000, 0x6012, true);
    file_.AddRange(0x6200, 0x627F, true);
    file_.AddRange(0x1801, 0x1801, true);
    file_.AddRange(0x000F, 0x000F, true);
    file_.AddRange(0x0191, 0x0191, true);
    for (const auto& [first, last] : {std::pair{0x1003, 0x1003},
                                      {0x1010, 0x1015},
                                      {0x1044, 0x1047},
                                      {0x1901, 0x1901},
                                      {0x2203, 0x2203},
                                      {0x602A, 0x602D}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), false);
    }
    shaft_.Call(Duration{}, 0.0);
  }

  std::expected<Registers, ExceptionCode> Read(std::uint16_t address, int count, Duration now) override {
    if (!file_.Readable(address, count)) return std::unexpected(kNoSuchAddress);
    Refresh(now);
    Registers registers;
    for (int i = 0; i < count; ++i) registers.push_back(file_.Get(static_cast<std::uint16_t>(address + i)));
    return registers;
  }

  std::expected<void, ExceptionCode> Write(std::uint16_t address, std::span<const std::uint16_t> registers,
                                           Duration now) override {
    const int count = static_cast<int>(registers.size());
    if (!file_.Writable(address, count)) return std::unexpected(kNoSuchAddress);
    Refresh(now);
    for (int i = 0; i < count; ++i) {
      file_.Set(static_cast<std::uint16_t>(address + i), registers[static_cast<std::size_t>(i)]);
    }
    if (address <= 0x6207 && address + count > 0x6207) {
      const std::uint16_t trigger = file_.Get(0x6207);
      file_.Set(0x6207, 0);
      if (trigger == 0x0010) RunPath(0, now);
    }
    if (address <= 0x6002 && address + count > 0x6002) Trigger(file_.Get(0x6002), now);
    if (address == 0x1801) Control(file_.Get(0x1801));
    return {};
  }

  void RaiseAlarm(std::uint32_t alarm, Duration now) override {
    alarm_ = alarm;
    if (alarm != 0) {
      shaft_.StopDead(now);
      homing_ = false;
    }
  }

  std::optional<ExceptionCode> OnBadChecksum() const override { return std::uint8_t{0x08}; }

 private:
  void Refresh(Duration now) {
    const bool moving = shaft_.MovingAt(now);
    if (homing_ && !moving) {
      homing_ = false;
      homed_ = true;
      shaft_.Call(now, 0.0);
    }
    int status = 1 << 1;
    if (alarm_ != 0) status |= 1 << 0;
    if (moving) status |= 1 << 2;
    if (!moving) status |= 1 << 4 | 1 << 5;
    if (homed_) status |= 1 << 6;
    file_.Set(0x1003, static_cast<std::uint16_t>(status));
    file_.Set(0x2203, static_cast<std::uint16_t>(alarm_));
    const std::int64_t count = std::llround(shaft_.CountAt(now));
    for (const int place : {0x1012, 0x1014, 0x602A, 0x602C}) file_.Set32(static_cast<std::uint16_t>(place), count);
  }

  void Trigger(std::uint16_t code, Duration now) {
    if (code >= 0x0010 && code <= 0x001F) return RunPath(code - 0x0010, now);
    if (code == 0x0020 && alarm_ == 0 && MayBegin()) {
      homing_ = true;
      homed_ = false;
      shaft_.MoveToReference(now, 50e3, 1e6);
    }
    if (code == 0x0021) {
      shaft_.Call(now, 0.0);
      homed_ = true;
    }
    if (code == 0x0040) {
      NoteStop();
      homing_ = false;
      shaft_.Stop(now, 1e7);
    }
  }

  /// Speed in r/min, acceleration in ms for 1000 r/min.
  void RunPath(int path, Duration now) {
    if (alarm_ != 0 || !MayBegin()) return;
    const auto base = static_cast<std::uint16_t>(0x6200 + 8 * path);
    const int mode = file_.Get(base);
    const double from = mode == 0x0001 ? 0.0 : shaft_.CountAt(now);
    const double speed = file_.Get(static_cast<std::uint16_t>(base + 3)) / 60.0 * kCountsPerRevolution;
    const double ramp_ms = std::max(1.0, double{file_.Get(static_cast<std::uint16_t>(base + 4)) * 1.0});
    if (speed <= 0 || (mode != 0x0001 && mode != 0x0041)) return;
    shaft_.MoveTo(now, from + file_.Get32(static_cast<std::uint16_t>(base + 1)), speed,
                  1000.0 / 60.0 * kCountsPerRevolution / (ramp_ms * 1e-3));
  }

  void Control(std::uint16_t word) {
    if (word == 0x1111) alarm_ = 0;
    if (word == 0x2211) file_.Set(0x1901, 0x5555);
    file_.Set(0x1801, 0);
  }

  static constexpr double kCountsPerRevolution = 10000.0;
  RegisterFile file_;
  std::uint32_t alarm_ = 0;
  bool homed_ = false;
  bool homing_ = false;
};

// ---- a plain register map -------------------------------------------------------------------------------------------

/// 0-1 target, 2-3 position, 4 speed, 5 trigger, 6 home, 7 stop, 8 reset, 10 status (busy, in position, fault, homed),
/// 11 alarm.
class Generic final : public ModbusDrive {
 public:
  explicit Generic(double counts) : ModbusDrive(counts) {
    file_.AddRange(0, 8, true);
    file_.AddRange(10, 11, false);
    file_.Set(4, 1000);
  }

  std::expected<Registers, ExceptionCode> Read(std::uint16_t address, int count, Duration now) override {
    if (!file_.Readable(address, count)) return std::unexpected(kNoSuchAddress);
    Refresh(now);
    Registers registers;
    for (int i = 0; i < count; ++i) registers.push_back(file_.Get(static_cast<std::uint16_t>(address + i)));
    return registers;
  }

  std::expected<void, ExceptionCode> Write(std::uint16_t address, std::span<const std::uint16_t> registers,
                                           Duration now) override {
    const int count = static_cast<int>(registers.size());
    if (!file_.Writable(address, count)) return std::unexpected(kNoSuchAddress);
    Refresh(now);
    for (int i = 0; i < count; ++i) {
      const auto where = static_cast<std::uint16_t>(address + i);
      file_.Set(where, registers[static_cast<std::size_t>(i)]);
      if (where >= 5 && file_.Get(where) == 1) Command(where, now);
    }
    return {};
  }

  void RaiseAlarm(std::uint32_t alarm, Duration now) override {
    alarm_ = alarm;
    if (alarm != 0) shaft_.StopDead(now);
  }

 private:
  void Refresh(Duration now) {
    const bool moving = shaft_.MovingAt(now);
    if (homing_ && !moving) {
      homing_ = false;
      homed_ = true;
      shaft_.Call(now, 0.0);
    }
    file_.Set32(2, std::llround(shaft_.CountAt(now)));
    file_.Set(10, static_cast<std::uint16_t>((moving ? 1 : 2) | (alarm_ != 0 ? 4 : 0) | (homed_ ? 8 : 0)));
    file_.Set(11, static_cast<std::uint16_t>(alarm_));
  }

  void Command(std::uint16_t where, Duration now) {
    const double speed = std::max(1.0, double{file_.Get(4) * 1.0});
    if (where == 5 && alarm_ == 0 && MayBegin()) shaft_.MoveTo(now, file_.Get32(0), speed, 50.0 * speed);
    if (where == 6 && alarm_ == 0 && MayBegin()) {
      homing_ = true;
      homed_ = false;
      shaft_.MoveToReference(now, speed, 50.0 * speed);
    }
    if (where == 7) {
      NoteStop();
      homing_ = false;
      shaft_.Stop(now, 50.0 * speed);
    }
    if (where == 8) alarm_ = 0;
    file_.Set(where, 0);
  }

  RegisterFile file_;
  std::uint32_t alarm_ = 0;
  bool homed_ = false;
  bool homing_ = false;
};

}  // namespace

void RegisterFile::AddRange(std::uint16_t first, std::uint16_t last, bool writable) {
  ranges_.push_back({first, last, writable});
}

bool RegisterFile::Covered(std::uint16_t address, int count, bool writable) const {
  const auto covered = [&](int at) {
    return std::ranges::any_of(ranges_, [&](const Stretch& range) {
      return at >= range.first && at <= range.last && (range.writable || !writable);
    });
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

std::int32_t RegisterFile::Get32(std::uint16_t address, bool low_first) const {
  std::uint32_t high = Get(address), low = Get(static_cast<std::uint16_t>(address + 1));
  if (low_first) std::swap(high, low);
  return static_cast<std::int32_t>(high << 16 | low);
}

void RegisterFile::Set32(std::uint16_t address, std::int64_t value, bool low_first) {
  const auto high = static_cast<std::uint16_t>(value >> 16 & 0xFFFF);
  const auto low = static_cast<std::uint16_t>(value & 0xFFFF);
  Set(address, low_first ? low : high);
  Set(static_cast<std::uint16_t>(address + 1), low_first ? high : low);
}

std::unique_ptr<ModbusDrive> MakeModbusDrive(std::string_view profile, double counts) {
  if (profile == "oriental-az") return std::make_unique<OrientalAz>(counts);
  if (profile == "moons") return std::make_unique<Moons>(counts);
  if (profile == "leadshine-rs") return std::make_unique<LeadshineRs>(counts);
  if (profile == "generic") return std::make_unique<Generic>(counts);
  return nullptr;
}

}  // namespace lensd::sim
