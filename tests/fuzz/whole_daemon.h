// A whole daemon in this process: two simulated lenses, served at an abstract socket.
#pragma once

#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "base/clock.h"
#include "daemon/config/config.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/lenses.h"
#include "daemon/methods/simulator_service.h"
#include "daemon/server/router.h"
#include "daemon/server/server.h"
#include "loop/event_loop.h"

namespace lensd::fuzz {

/// Sanitizers and neighbours make everything slower; what never comes does not come in this time either.
constexpr Duration kNever = std::chrono::seconds(20);

/// Ends the fuzzer with what it has found.
[[noreturn]] inline void Found(const std::string& what) {
  std::fprintf(stderr, "fuzz_calls: %s\n", what.c_str());
  std::abort();
}

constexpr const char* kScene = R"(version = 1
[camera]
width = 48
height = 32
pixel_um = 3.45
exposure_ms = 0.5
frame_rate_hz = 500
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 401
speed_steps_per_s = 20000
acceleration_steps_per_s2 = 5000000
settle_ms = 1
iris_steps = 20
initial_f_number = 2.0
[[surface]]
kind = "wall"
distance_m = 1.2
sinusoid_px = [8.0, 0.0]
)";

/// Configuration and state of all daemons of this process.
class Folder {
 public:
  Folder() {
    path_ = mkdtemp(name_);
    std::ofstream(path_ + "/scene.toml") << kScene;
    std::ofstream config(path_ + "/lensd.toml");
    config << "version = 1\n";
    for (const char* name : {"a", "b"}) {
      config << "[[lens]]\nname = \"" << name << "\"\ndriver = \"sim\"\nscene = \"scene.toml\"\n";
    }
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string config() const { return path_ + "/lensd.toml"; }
  /// Empty again.
  std::string State() const {
    std::filesystem::remove_all(path_ + "/state");
    std::filesystem::create_directory(path_ + "/state");
    return path_ + "/state";
  }

 private:
  char name_[32] = "/dev/shm/lensd-calls-XXXXXX";
  std::string path_;
};

inline sockaddr_un Address() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // Abstract: it is in no folder, and is gone with this process.
  (void)std::snprintf(address.sun_path + 1, sizeof address.sun_path - 1, "lensd-fuzz-%d", static_cast<int>(getpid()));
  return address;
}

inline const sockaddr* Generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

class Daemon {
 public:
  explicit Daemon(const Folder& folder)
      : loop_(*daemon::EventLoop::Create()),
        service_(*loop_, clock_, folder.State()),
        simulator_(service_),
        router_({"lensd", "lensd", "0", "https://lensd.io"}),
        listening_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const auto config = daemon::ReadConfig(folder.config());
    if (!config || !daemon::AddLenses(*config, clock_, service_)) Found("its own configuration is refused");
    const sockaddr_un address = Address();
    if (bind(listening_, Generic(address), sizeof address) != 0 || listen(listening_, 64) != 0) Found("no socket");
    router_.Add(service_);
    router_.Add(simulator_);
    server_ = *daemon::Server::Create(*loop_, listening_, router_, {}, "io.lensd.Lens.Busy", [](std::string_view) {});
    loop_->Supervise([this] { service_.LookAfter(); });
    service_.Begin();
    thread_ = std::thread([this] {
      if (!loop_->Run()) Found("the loop failed");
    });
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  /// It comes to its end in time, whatever was asked of it.
  ~Daemon() {
    const Instant deadline = clock_.Now() + kNever;
    loop_->Post([this, deadline] {
      service_.End(daemon::ServedLens::Parks::No);
      Quit(deadline);
    });
    thread_.join();
    server_.reset();
    close(listening_);
  }

 private:
  void Quit(Instant deadline) {
    if (service_.StillEnding().empty()) return loop_->Quit();
    if (clock_.Now() >= deadline) Found("it does not end");
    loop_->After(std::chrono::milliseconds(1), [this, deadline] { Quit(deadline); });
  }

  MonotonicClock clock_;
  std::unique_ptr<daemon::EventLoop> loop_;
  daemon::LensService service_;
  daemon::SimulatorService simulator_;
  daemon::Router router_;
  int listening_;
  std::unique_ptr<daemon::Server> server_;
  std::thread thread_;
};

}  // namespace lensd::fuzz
