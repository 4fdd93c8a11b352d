// Leadshine RS.
#include <algorithm>
#include <cmath>

#include "drives.h"

namespace lensd::sim {
namespace {

/// PR paths at 0x6200, trigger at 0x6002.
class LeadshineRs final : public ModbusDrive {
 public:
  explicit LeadshineRs(double counts) : ModbusDrive(counts) {
    file_.AddRange(0x6000, 0x6012, RegisterFile::Access::Write);
    file_.AddRange(0x6200, 0x627F, RegisterFile::Access::Write);
    file_.AddRange(0x1801, 0x1801, RegisterFile::Access::Write);
    file_.AddRange(0x000F, 0x000F, RegisterFile::Access::Write);
    file_.AddRange(0x0191, 0x0191, RegisterFile::Access::Write);
    for (const auto& [first, last] : {std::pair{0x1003, 0x1003},
                                      {0x1010, 0x1015},
                                      {0x1044, 0x1047},
                                      {0x1901, 0x1901},
                                      {0x2203, 0x2203},
                                      {0x602A, 0x602D}}) {
      file_.AddRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last), RegisterFile::Access::Read);
    }
    shaft_.Call(Duration{}, 0.0);
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
  std::expected<void, ExceptionCode> Obey(const Written& written, Duration now) override {
    if (written.Has(0x6207)) {
      const std::uint16_t trigger = file_.Get(0x6207);
      file_.Set(0x6207, 0);
      if (trigger == 0x0010) RunPath(0, now);
    }
    if (written.Has(0x6002)) Trigger(file_.Get(0x6002), now);
    if (written.first == 0x1801) Control(file_.Get(0x1801));
    return {};
  }

  void Refresh(Duration now) override {
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
  std::uint32_t alarm_ = 0;
  bool homed_ = false;
  bool homing_ = false;
};

}  // namespace

std::unique_ptr<ModbusDrive> MakeLeadshineRs(double counts) {
  return std::make_unique<LeadshineRs>(counts);
}

}  // namespace lensd::sim
