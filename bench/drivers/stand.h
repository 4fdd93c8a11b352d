// A driver on its simulated device, in this process: what is timed, what is made to go wrong, and the device's own
// truth.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/device.h"
#include "rig/config.h"

namespace lensd::bench {

/// What befalls exchanges with the device, each with its probability.
struct Weather {
  double lost = 0.0;       ///< obeyed, never answered
  double late = 0.0;       ///< obeyed, answered `late_by` later
  Duration late_by{};      ///< set before the device is opened
  double disobeyed = 0.0;  ///< a motion is acknowledged and not begun
};

class DriverStand {
 public:
  DriverStand() = default;
  virtual ~DriverStand() = default;
  DriverStand(const DriverStand&) = delete;
  DriverStand& operator=(const DriverStand&) = delete;

  /// The driver's lens on the device, ready to move its focus. Once.
  virtual Result<drivers::Device> Open() = 0;
  /// From now on.
  virtual void SetWeather(const Weather& weather) = 0;
  /// One exchange over the same wire without the driver; may be called before Open() only.
  virtual Result<void> BareExchange() = 0;
  /// Where the focus mechanism is, as the device itself has it.
  virtual double TrueFocus() = 0;
  virtual rig::RigConfig Config() const { return {}; }
  virtual const Clock& clock() const = 0;
  virtual void WaitUntil(Instant until) = 0;
};

/// On real sockets and terminals: time passes by itself.
class RealTimeStand : public DriverStand {
 public:
  const Clock& clock() const override { return clock_; }
  void WaitUntil(Instant until) override { std::this_thread::sleep_until(until); }

 private:
  MonotonicClock clock_;
};

/// Behind the driver's transport seam: time passes only on the wire, which takes 250 us a transfer as USB does.
class ModelStand : public DriverStand {
 public:
  const Clock& clock() const override { return clock_; }
  void WaitUntil(Instant until) override { clock_.AdvanceTo(until); }

 protected:
  SteppedClock clock_;
};

/// What the weather's numbers are drawn with: the same every time.
inline constexpr unsigned kWeatherSeed = 7;

std::unique_ptr<DriverStand> MakeModbusTcpStand(const Weather& weather);
std::unique_ptr<DriverStand> MakeModbusRtuStand(const Weather& weather);
std::unique_ptr<DriverStand> MakeLensConnectStand(const Weather& weather);
std::unique_ptr<DriverStand> MakeUvcStand(const Weather& weather);
/// Null: another process plays a camera at 127.0.0.1.
std::unique_ptr<DriverStand> MakeGigeStand(const Weather& weather);

}  // namespace lensd::bench
