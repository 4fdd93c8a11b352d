// What the contract suite needs of a driver: a test stand that opens the device, unplugs it and lets time pass.
//
// A driver instantiates the suites in its own test program:
//
//   class MyStand final : public contract::SteppedStand {     // or RealStand, where time is the machine's
//    public:
//     Result<drivers::Device> Open() override { return OpenMine(settings, clock()); }
//     bool Unplug() override { wire_.Cut(); return true; }
//     void Plug() override { wire_.Mend(); }
//   };
//   INSTANTIATE_TEST_SUITE_P(Mine, LensContract, contract::Stands<MyStand>());
//   INSTANTIATE_TEST_SUITE_P(Mine, CameraContract, contract::Stands<MyStand>());   // where it has a camera
//
// and in CMake: lensd_test(mine SOURCES ... ROOMS ... LIBRARIES contract_suite).
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/device.h"

namespace lensd::contract {

/// One device on its bench. Used by one thread. A test makes its own stand, so that nothing is left over from others.
class Stand {
 public:
  virtual ~Stand() = default;

  /// Opens the device. Called again only once the device opened before is destroyed.
  virtual Result<drivers::Device> Open() = 0;
  /// The clock the device was opened with.
  virtual const Clock& clock() const = 0;
  /// Lets that much time pass for the device: steps its clock, or sleeps.
  virtual void Advance(Duration by) = 0;
  /// Takes the device away while it is open. False: this stand cannot, and the tests that need it are skipped.
  virtual bool Unplug() { return false; }
  /// Brings it back; the device that lost it has been destroyed.
  virtual void Plug() {}

  /// How long any motion of the device may take, in its time.
  virtual Duration LongestMotion() const { return std::chrono::seconds(30); }
  /// Time between two looks at a moving device.
  virtual Duration LookEvery() const { return std::chrono::milliseconds(5); }
  /// How far from the target an axis that is read back may come to rest: native units beyond its resolution.
  virtual double RestsWithin(drivers::Axis) const { return 0.0; }
};

/// A stand on a clock that only Advance() moves.
class SteppedStand : public Stand {
 public:
  const Clock& clock() const override { return clock_; }
  void Advance(Duration by) override { clock_.Advance(by); }

 protected:
  SteppedClock clock_;
};

/// A stand on the machine's clock: for kernel drivers and drivers with threads of their own.
class RealStand : public Stand {
 public:
  const Clock& clock() const override { return clock_; }
  void Advance(Duration by) override { std::this_thread::sleep_for(by); }

 private:
  MonotonicClock clock_;
};

using MakeStand = std::function<std::unique_ptr<Stand>()>;
/// For the names of the tests, which must not differ from run to run.
inline void PrintTo(const MakeStand&, std::ostream* out) {
  *out << "stand";
}

template <class Mine>
auto Stands() {
  return ::testing::Values(MakeStand([]() -> std::unique_ptr<Stand> { return std::make_unique<Mine>(); }));
}

}  // namespace lensd::contract

namespace lensd {

/// The code a call failed with; none where it did not.
template <class T>
std::optional<Code> CodeOf(const Result<T>& result) {
  if (result) return std::nullopt;
  return result.error().code;
}

/// What both suites do: a stand, and the device opened on it.
class ContractTest : public ::testing::TestWithParam<contract::MakeStand> {
 protected:
  void SetUp() override;

  /// Opens the device into `device_`; a failure fails the test.
  void Open();
  /// Destroys it.
  void Close() { device_ = {}; }
  /// Looks every LookEvery() until `done`, within LongestMotion(). False: it never was.
  bool Until(const std::function<bool()>& done);

  drivers::Lens& lens() { return *device_.lens; }
  drivers::Camera& camera() { return *device_.camera; }

  std::unique_ptr<contract::Stand> stand_;
  drivers::Device device_;
};

/// What every lens promises (drivers/api/lens.h).
class LensContract : public ContractTest {
 protected:
  void SetUp() override;
  /// Opens, and homes every axis that wants it before it moves.
  void OpenReady();
  void HomeWhatNeedsIt();
  /// The target at `fraction` of the axis' range, on its grid.
  Native TargetAt(drivers::Axis axis, double fraction) const;
  /// The axes the lens has.
  std::vector<drivers::Axis> Axes() const;
  /// Waits until the axis rests; its state then.
  drivers::AxisState RestOf(drivers::Axis axis);
  void ExpectAt(drivers::Axis axis, const drivers::AxisState& state, Native target);
  void MoveAndRest(drivers::Axis axis, Native target);
};

/// What every camera promises (drivers/api/camera.h).
class CameraContract : public ContractTest {
 protected:
  void SetUp() override;
  /// The next frame, within LongestMotion(); fails the test without one.
  std::optional<drivers::Frame> Next();
};

}  // namespace lensd
