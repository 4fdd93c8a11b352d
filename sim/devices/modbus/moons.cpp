// Moons'/Applied Motion.
#include <algorithm>
#include <cmath>

#include "drives.h"

namespace lensd::sim {
namespace {

/// Opcodes at 40125. Registers that are not there answer with codes of their own.
class Moons final : public ModbusDrive {
 public:
  explicit Moons(double counts) : ModbusDrive(counts, {.read = 0x11, .write = 0x12, .most = 50}) {
    for (const auto& [first, last] : {std::pair{0, 1}, {3, 7}, {10, 15}, {111, 111}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), RegisterFile::Access::Read);
    }
    for (const auto& [first, last] : {std::pair{27, 31}, {46, 48}, {124, 129}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), RegisterFile::Access::Write);
    }
    shaft_.Call(Duration{}, 0.0);  // it counts from where it was switched on
    for (const auto& [address, value] : {std::pair{27, 600}, {28, 600}, {29, 240}}) {
      file_.Set(static_cast<std::uint16_t>(address), static_cast<std::uint16_t>(value));
    }
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
  std::expected<void, ExceptionCode> Obey(const Written& written, Duration now) override {
    if (written.Has(124)) return Execute(file_.Get(124), now);
    return {};
  }

  void Refresh(Duration now) override {
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

  std::uint32_t alarm_ = 0;
  bool enabled_ = true;
  bool homing_ = false;
  bool jogging_ = false;
  double encoder_zero_ = 0.0;
};

}  // namespace

std::unique_ptr<ModbusDrive> MakeMoons(double counts) {
  return std::make_unique<Moons>(counts);
}

}  // namespace lensd::sim
