// The table of drivers of lensd_faulty: the simulated lens, whose driver throws and hangs where a file beside its scene
// says so: SCENE.faults, with lines like "move throw" and "read hang".
#include "daemon/config/drivers_table.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "drivers/api/thread_barrier.h"
#include "sim/driver.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}
  /// What the file says of `place` now; a call that hangs comes back once the file says neither that nor "held".
  void At(const std::string& place) const {
    if (Says(place + " throw")) throw std::runtime_error("the " + place + " of the test threw");
    if (!Says(place + " hang")) return;
    while (Says(place + " hang") || Says("held")) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  bool Says(const std::string& fault) const {
    std::ifstream file(file_);
    for (std::string line; std::getline(file, line);) {
      if (line == fault) return true;
    }
    return false;
  }

 private:
  const std::string file_;
};

class FaultyLens final : public drivers::Lens {
 public:
  FaultyLens(std::unique_ptr<drivers::Lens> lens, std::shared_ptr<const Faults> faults)
      : Lens(lens->capabilities()), lens_(std::move(lens)), faults_(std::move(faults)) {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        if (!barrier_.Run([this] { faults_->At("background"); })) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    });
  }
  ~FaultyLens() override {
    drivers::Contain([this] { faults_->At("close"); });
  }

 private:
  Result<void> DoStartHome(Axis axis) override { return lens_->StartHome(axis); }
  Result<void> DoStartMove(Axis axis, Native target) override {
    faults_->At("move");
    return lens_->StartMove(axis, target);
  }
  Result<void> DoStop(Axis axis) override {
    faults_->At("stop");
    return lens_->Stop(axis);
  }
  Result<drivers::LensState> DoRead() override {
    barrier_.Check();
    faults_->At("read");
    return lens_->Read();
  }

  const std::unique_ptr<drivers::Lens> lens_;
  const std::shared_ptr<const Faults> faults_;
  drivers::ThreadBarrier barrier_;
  std::jthread thread_;  // last: it uses the others
};

std::string SceneOf(const Settings& settings) {
  SettingsReader read(settings, "driver \"sim\"");
  return read.OptionalPath("scene").value_or("");
}

Result<drivers::Device> OpenFaulty(const Settings& settings, const Clock& clock) {
  const auto faults = std::make_shared<const Faults>(SceneOf(settings) + ".faults");
  faults->At("open");
  auto device = sim::OpenSim(settings, clock);
  if (device) device->lens = std::make_unique<FaultyLens>(std::move(device->lens), faults);
  return device;
}

constexpr drivers::Driver kDrivers[] = {
    {.name = "sim", .open = OpenFaulty, .probe = nullptr, .check = sim::CheckSim, .simulated = true, .reopen = false}};

}  // namespace

std::span<const drivers::Driver> Drivers() {
  return kDrivers;
}

const drivers::Driver* FindDriver(std::string_view name) {
  return name == kDrivers[0].name ? kDrivers : nullptr;
}

const DriverNeeds& NeedsOf(std::string_view) {
  static const DriverNeeds nothing;
  return nothing;
}

std::string DriverNames() {
  return std::string(kDrivers[0].name);
}

std::optional<int> BeginDrivers(std::span<char*>) {
  return std::nullopt;
}

}  // namespace lensd::daemon
