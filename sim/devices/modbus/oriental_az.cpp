// Oriental Motor AZ.
#include <algorithm>
#include <cmath>
#include <utility>

#include "drives.h"

namespace lensd::sim {
namespace {

/// Direct data operation at 0x0058, driver input at 0x007C (levels) and 0x0078 (pulses), output at 0x007E.
class OrientalAz final : public ModbusDrive {
 public:
  explicit OrientalAz(double counts) : ModbusDrive(counts) {
    file_.AddRange(0x0058, 0x0069, RegisterFile::Access::Write);
    file_.AddRange(0x0078, 0x007D, RegisterFile::Access::Write);
    for (const auto& [first, last] : {std::pair{0x007E, 0x0095},
                                      {0x00AC, 0x00AD},
                                      {0x00C6, 0x00D7},
                                      {0x00F8, 0x00FB},
                                      {0x0120, 0x0123},
                                      {0x0178, 0x017F}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), RegisterFile::Access::Read);
    }
    file_.AddRange(0x0180, 0x018D, RegisterFile::Access::Write);
    file_.AddRange(0x0386, 0x038B, RegisterFile::Access::Write);
    file_.AddRange(0x1800, 0x180B, RegisterFile::Access::Write);
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

  std::expected<void, ExceptionCode> Obey(const Written& written, Duration now) override {
    if (written.Has(0x0067) && file_.Get32(0x0066) == 1) {
      Trigger(now);
      file_.Set32(0x0066, 0);  // it clears by itself
    }
    Input(std::exchange(input_, file_.Get32(0x007C)), file_.Get32(0x007C), now);
    if (const std::int32_t pulse = file_.Get32(0x0078); pulse != 0) {
      Input(0, pulse, now);
      file_.Set32(0x0078, 0);
    }
    if (std::exchange(reset_, file_.Get32(0x0180)) == 0 && reset_ == 1) Reset();
    if (std::exchange(preset_, file_.Get32(0x018A)) == 0 && preset_ == 1) Preset(now);
    return {};
  }

  void Refresh(Duration now) override {
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

  /// Levels as last written: what counts is their rise.
  std::int32_t input_ = 0, reset_ = 0, preset_ = 0;
  std::uint32_t alarm_ = 0;
  std::vector<std::uint32_t> history_;
  bool homed_ = false;
  bool homing_ = false;
};

}  // namespace

std::unique_ptr<ModbusDrive> MakeOrientalAz(double counts) {
  return std::make_unique<OrientalAz>(counts);
}

}  // namespace lensd::sim
