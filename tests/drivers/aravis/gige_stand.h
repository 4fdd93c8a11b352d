// The simulated camera on this machine's loopback, and what opens it.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "drivers/aravis/driver.h"
#include "sim/devices/gige_camera.h"
#include "stand.h"

namespace lensd::testing {

/// GigE Vision has one port an address: whoever plays a camera at 127.0.0.1 holds this, in any process. A process that
/// own_network.py started in a network of its own has that address for itself, and waits for nobody.
class LoopbackTurn {
 public:
  LoopbackTurn() {
    if (std::getenv("LENSD_OWN_NETWORK") != nullptr) return;
    file_ = open("/tmp/lensd-test-gige.lock", O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    flock(file_, LOCK_EX);
  }
  ~LoopbackTurn() {
    if (file_ >= 0) close(file_);
  }
  LoopbackTurn(const LoopbackTurn&) = delete;
  LoopbackTurn& operator=(const LoopbackTurn&) = delete;

 private:
  int file_ = -1;
};

/// Settings from keys and values.
inline Settings Table(std::map<std::string, Settings::Value> keys) {
  Settings::Table table;
  for (auto& [key, value] : keys) table.emplace(key, Settings(std::move(value), {"test", 1}));
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(table)), {"test", 1});
}

class GigeStand : public contract::RealStand {
 public:
  explicit GigeStand(sim::GigeOptions options = {}, std::map<std::string, Settings::Value> keys = {})
      : options_(std::move(options)), keys_(std::move(keys)) {
    if (options_.scene.empty()) options_.scene = std::string(LENSD_SOURCE_DIR) + "/tests/drivers/aravis/quick.toml";
    keys_.emplace("address", options_.interface);
    keys_.emplace("packet_size", std::int64_t{8192});
    GigeStand::Plug();
  }

  Result<drivers::Device> Open() override { return drivers::aravis::OpenAravis(Table(keys_), clock()); }
  bool Unplug() override {
    camera_.reset();
    return true;
  }
  void Plug() override {
    auto camera = sim::GigeCamera::Start(options_, clock());
    if (!camera) throw std::runtime_error(camera.error().message);
    camera_ = *std::move(camera);
  }
  /// In place of the one that was unplugged.
  void PlugAnother(std::string serial) {
    options_.serial = std::move(serial);
    Plug();
  }
  bool plugged() const { return camera_ != nullptr; }
  sim::GigeCamera& camera() { return *camera_; }

 private:
  LoopbackTurn turn_;
  sim::GigeOptions options_;
  std::map<std::string, Settings::Value> keys_;
  std::unique_ptr<sim::GigeCamera> camera_;
};

}  // namespace lensd::testing
