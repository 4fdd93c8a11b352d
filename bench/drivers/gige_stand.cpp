// A GigE Vision camera with a motorised lens, on UDP sockets of this machine. Its exchanges are never spoilt here: what
// is lost on a network is tried by the driver's tests, with a program between the two.
#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bench/drivers/stand.h"
#include "drivers/aravis/driver.h"
#include "sim/devices/gige_camera.h"

namespace lensd::bench {
namespace {

constexpr std::uint16_t kControlPort = 3956;
constexpr const char* kScene = "tests/drivers/aravis/quick.toml";

/// GigE Vision has one port an address: a process that plays a camera at 127.0.0.1 holds this file, in any process.
class LoopbackTurn {
 public:
  LoopbackTurn() : file_(::open("/tmp/lensd-test-gige.lock", O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
    mine_ = ::flock(file_, LOCK_EX | LOCK_NB) == 0;
  }
  ~LoopbackTurn() { ::close(file_); }
  LoopbackTurn(const LoopbackTurn&) = delete;
  LoopbackTurn& operator=(const LoopbackTurn&) = delete;
  bool mine() const { return mine_; }

 private:
  int file_;
  bool mine_;
};

class GigeStand final : public RealTimeStand {
 public:
  ~GigeStand() override {
    if (socket_ >= 0) ::close(socket_);
  }
  bool mine() const { return turn_.mine(); }

  Result<drivers::Device> Open() override {
    if (auto started = Start(); !started) return PassOn(started);
    Settings::Table keys;
    const auto add = [&](const char* key, Settings::Value value) {
      keys.emplace(key, Settings(std::move(value), {"lens-bench", 1}));
    };
    add("address", std::string("127.0.0.1"));
    add("packet_size", std::int64_t{8192});
    add("feedback", std::string("encoder"));
    return drivers::aravis::OpenAravis(
        Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(keys)), {"lens-bench", 1}), clock());
  }
  void SetWeather(const Weather&) override {}
  Result<void> BareExchange() override {
    if (auto started = Start(); !started) return started;
    if (socket_ < 0) socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    // Read the register that has the protocol's version.
    constexpr std::uint8_t kQuestion[] = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x00, 0x01, 0, 0, 0, 0};
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(kControlPort);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::sendto(socket_, kQuestion, sizeof kQuestion, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    std::uint8_t answer[64];
    if (::poll(&ready, 1, 1000) != 1 || ::recv(socket_, answer, sizeof answer, 0) <= 0)
      return Fail(Code::Timeout, "the simulated GigE camera does not answer");
    return {};
  }
  double TrueFocus() override { return camera_->TrueFocus(); }
  rig::RigConfig Config() const override {
    rig::RigConfig config;
    config.axes[drivers::Axis::Focus].speed = 20000.0;
    config.axes[drivers::Axis::Focus].settle = std::chrono::milliseconds(5);
    return config;
  }

 private:
  Result<void> Start() {
    if (camera_ != nullptr) return {};
    sim::GigeOptions options;
    options.scene = kScene;
    options.focus_zero = sim::GigeFocusZero::Far;  // counts are those of the mechanism, which TrueFocus() says
    auto camera = sim::GigeCamera::Start(options, clock());
    if (!camera) return PassOn(camera);
    camera_ = *std::move(camera);
    return {};
  }

  LoopbackTurn turn_;
  std::unique_ptr<sim::GigeCamera> camera_;
  int socket_ = -1;
};

}  // namespace

std::unique_ptr<DriverStand> MakeGigeStand(const Weather&) {
  auto stand = std::make_unique<GigeStand>();
  return stand->mine() ? std::move(stand) : nullptr;
}

}  // namespace lensd::bench
