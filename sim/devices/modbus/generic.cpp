// A plain register map.
#include <algorithm>
#include <cmath>

#include "drives.h"

namespace lensd::sim {
namespace {

/// 0-1 target, 2-3 position, 4 speed, 5 trigger, 6 home, 7 stop, 8 reset, 10 status (busy, in position, fault, homed),
/// 11 alarm.
class Generic final : public ModbusDrive {
 public:
  explicit Generic(double counts) : ModbusDrive(counts) {
    file_.AddRange(0, 8, RegisterFile::Access::Write);
    file_.AddRange(10, 11, RegisterFile::Access::Read);
    file_.Set(4, 1000);
  }

  void RaiseAlarm(std::uint32_t alarm, Duration now) override {
    alarm_ = alarm;
    if (alarm != 0) shaft_.StopDead(now);
  }

 private:
  std::expected<void, ExceptionCode> Obey(const Written& written, Duration now) override {
    for (std::uint16_t where = 5; where <= 8; ++where) {
      if (written.Has(where) && file_.Get(where) == 1) Command(where, now);
    }
    return {};
  }

  void Refresh(Duration now) override {
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

  std::uint32_t alarm_ = 0;
  bool homed_ = false;
  bool homing_ = false;
};

}  // namespace

std::unique_ptr<ModbusDrive> MakeGeneric(double counts) {
  return std::make_unique<Generic>(counts);
}

}  // namespace lensd::sim
