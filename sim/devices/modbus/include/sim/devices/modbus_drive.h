// Stepper and servo drives as their Modbus registers show them. Nothing here is shared with drivers/modbus: the
// addresses are written down twice, so that a mistake in one of them shows.
#pragma once

#include <cstdint>
#include <expected>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/clock.h"

namespace lensd::sim {

/// A motor's shaft in counts. Times count from the making of the bus and never go back.
class Shaft {
 public:
  explicit Shaft(double counts) : place_(counts) {}

  void MoveTo(Duration at, double target, double speed, double acceleration);
  /// To the mechanical reference, which is at 0 until Call() says otherwise.
  void MoveToReference(Duration at, double speed, double acceleration);
  void Stop(Duration at, double deceleration);
  void StopDead(Duration at);
  /// From now on, here is `counts`.
  void Call(Duration at, double counts);

  double CountAt(Duration at) const;
  double SpeedAt(Duration at) const;
  bool MovingAt(Duration at) const;
  double target() const { return target_ - zero_; }

 private:
  struct Stretch {
    double seconds, position, speed, acceleration;
  };
  void Go(Duration at, double target, double speed, double acceleration);

  double place_;  ///< from the reference
  double target_ = place_;
  double zero_ = 0.0;  ///< of the count, from the reference
  Duration since_{};
  std::vector<Stretch> path_;
};

/// Registers that are there, each in one of a few ranges.
class RegisterFile {
 public:
  enum class Access { Read, Write };
  /// Write: and to read.
  void AddRange(std::uint16_t first, std::uint16_t last, Access access);
  bool Readable(std::uint16_t address, int count) const { return Covered(address, count, Access::Read); }
  bool Writable(std::uint16_t address, int count) const { return Covered(address, count, Access::Write); }

  std::uint16_t Get(std::uint16_t address) const;
  void Set(std::uint16_t address, std::uint16_t value) { values_[address] = value; }
  /// 32 bits, the upper half at the lower address.
  std::int32_t Get32(std::uint16_t address) const;
  void Set32(std::uint16_t address, std::int64_t value);

 private:
  struct Stretch {
    std::uint16_t first, last;
    Access access;
  };
  bool Covered(std::uint16_t address, int count, Access access) const;

  std::vector<Stretch> ranges_;
  std::map<std::uint16_t, std::uint16_t> values_;
};

/// A drive behind its registers. What is thrown at it it answers as its manual says.
class ModbusDrive {
 public:
  using Registers = std::vector<std::uint16_t>;
  using ExceptionCode = std::uint8_t;

  virtual ~ModbusDrive() = default;

  std::expected<Registers, ExceptionCode> Read(std::uint16_t address, int count, Duration now);
  std::expected<void, ExceptionCode> Write(std::uint16_t address, std::span<const std::uint16_t> registers,
                                           Duration now);
  /// The alarm it raises by itself, 0: none. Motion ends.
  virtual void RaiseAlarm(std::uint32_t alarm, Duration now) = 0;
  /// What it answers to a request with a wrong checksum; none: silence.
  virtual std::optional<ExceptionCode> OnBadChecksum() const { return std::nullopt; }

  /// The next `count` motions are acknowledged and not begun.
  void Ignore(int count) { ignored_ = count; }
  /// The motor stands still whatever it is told, as one whose shaft is blocked and that does not notice.
  void Block(bool blocked) { blocked_ = blocked; }
  /// Without power so long: the motor stands where it is, no request is answered. What it remembers is absolute.
  void LosePower(Duration now, Duration how_long) {
    shaft_.StopDead(now);
    dark_until_ = now + how_long;
  }
  bool DarkAt(Duration now) const { return now < dark_until_; }
  /// Registers that are read so long are those of now.
  void Freeze(Duration now, Duration how_long) {
    Refresh(now);
    frozen_until_ = now + how_long;
  }
  /// Here is now `counts`, as if a client had told it so.
  void SetCount(Duration now, double counts) { shaft_.Call(now, counts); }
  /// As SetCount(0), and that is its reference.
  virtual void Preset(Duration now) { SetCount(now, 0.0); }
  const Shaft& shaft() const { return shaft_; }
  /// Motions begun so far.
  int motions() const { return motions_; }
  int stops() const { return stops_; }

 protected:
  /// What it answers where registers are not there, and how many it lets be read at once.
  struct Refusals {
    ExceptionCode read, write;
    int most;
  };
  struct Written {
    std::uint16_t first;
    int count;
    bool Has(int address) const { return address >= first && address < first + count; }
  };

  explicit ModbusDrive(double counts, Refusals refusals = {0x02, 0x02, 125}) : shaft_(counts), refusals_(refusals) {}

  /// Has the registers show how things are.
  virtual void Refresh(Duration now) = 0;
  /// Does what registers that have just been written ask for.
  virtual std::expected<void, ExceptionCode> Obey(const Written& written, Duration now) = 0;

  /// Whether a motion that is due may begin.
  bool MayBegin() {
    if (ignored_ > 0) {
      --ignored_;
      return false;
    }
    ++motions_;
    return !blocked_;
  }
  void NoteStop() { ++stops_; }

  Shaft shaft_;
  RegisterFile file_;

 private:
  const Refusals refusals_;
  int ignored_ = 0;
  int motions_ = 0;
  int stops_ = 0;
  bool blocked_ = false;
  Duration dark_until_{}, frozen_until_{};
};

/// "oriental-az", "moons", "leadshine-rs", "generic" (the map of the driver's generic profile). `counts`: where it
/// stands when switched on; the mechanical reference is at 0 until it is told otherwise. nullptr: no such profile.
std::unique_ptr<ModbusDrive> MakeModbusDrive(std::string_view profile, double counts = 300.0);

}  // namespace lensd::sim
