// An Oriental Motor AZ drive on a real line: a pseudo-terminal, or a TCP connection of this machine.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <filesystem>
#include <random>
#include <vector>

#include "bench/drivers/stand.h"
#include "drivers/modbus/driver.h"
#include "io/toml.h"
#include "sim/devices/modbus/wire.h"
#include "sim/devices/modbus_bus.h"

namespace lensd::bench {
namespace {

using drivers::Axis;
using sim::WireFault;

constexpr int kUnit = 1;
constexpr std::uint8_t kReadRegisters = 3, kPositionRegister = 0xCC;

enum class Wire { Tcp, Rtu };

/// What the daemon does with settings: the drive's `profile = "NAME"` becomes the profile's table.
Result<Settings> WithProfile(const Settings& settings) {
  const Settings::Table* table = settings.AsTable();
  if (table == nullptr) return settings;
  Settings::Table done;
  for (const auto& [key, value] : *table) {
    const auto* name = std::get_if<std::string>(&value.value());
    auto inner = key == "profile" && name != nullptr
                     ? io::ParseToml(drivers::modbus::ShippedProfile(*name), "profile " + *name)
                     : WithProfile(value);
    if (!inner) return PassOn(inner);
    done.emplace(key, *std::move(inner));
  }
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(done)), settings.where());
}

class ModbusStand final : public RealTimeStand {
 public:
  ModbusStand(Wire wire, const Weather& weather) : wire_(wire) {
    std::string folder = std::filesystem::temp_directory_path() / "lens-bench-modbus-XXXXXX";
    if (::mkdtemp(folder.data()) != nullptr) folder_ = folder;
    bus_.AddDrive(kUnit, sim::MakeModbusDrive("oriental-az"));
    bus_.SetLate(weather.late_by);
  }
  ~ModbusStand() override {
    if (bare_ >= 0) ::close(bare_);
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
  }

  Result<drivers::Device> Open() override {
    if (auto served = Serve(); !served) return PassOn(served);
    if (bare_ >= 0) ::close(std::exchange(bare_, -1));
    const std::string where =
        wire_ == Wire::Rtu ? "device = \"" + Port() + "\"" : "host = \"127.0.0.1:" + std::to_string(port_) + "\"";
    const auto settings = io::ParseToml(
        "[bus]\nname = \"bench\"\n" + where +
            "\nresponse_timeout_ms = 30\n[drives.focus]\nunit = 1\nprofile = \"oriental-az\"\nrange = [0, 2000]\n"
            "parameters = { speed = 20000, start_rate = 5000000, stop_rate = 5000000 }\n",
        "lens-bench");
    if (!settings) return PassOn(settings);
    const auto whole = WithProfile(*settings);
    if (!whole) return PassOn(whole);
    return drivers::modbus::OpenModbus(*whole, clock());
  }
  void SetWeather(const Weather& weather) override {
    bus_.SetRandomFaults(
        {{WireFault::NoReply, weather.lost}, {WireFault::Late, weather.late}, {WireFault::Ignore, weather.disobeyed}},
        kWeatherSeed);
  }
  Result<void> BareExchange() override {
    if (auto served = Serve(); !served) return served;
    if (bare_ < 0) bare_ = wire_ == Wire::Rtu ? OpenTerminal() : Connect();
    const std::vector<std::uint8_t> question = {kUnit, kReadRegisters, 0, kPositionRegister, 0, 2};
    std::vector<std::uint8_t> bytes = {0, 1, 0, 0, 0, 6};  // number, protocol, length
    if (wire_ == Wire::Rtu) {
      bytes = sim::wire::Rtu(question);
    } else {
      bytes.insert(bytes.end(), question.begin(), question.end());
    }
    const std::size_t expected = wire_ == Wire::Rtu ? 9 : 13;
    if (::write(bare_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      return Fail(Code::Io, "cannot write to the simulated Modbus line");
    std::size_t got = 0;
    while (got < expected) {
      pollfd ready{.fd = bare_, .events = POLLIN, .revents = 0};
      std::uint8_t answer[64];
      if (::poll(&ready, 1, 1000) != 1) return Fail(Code::Timeout, "the simulated Modbus drive does not answer");
      const ssize_t count = ::read(bare_, answer, sizeof answer);
      if (count <= 0) return Fail(Code::Io, "the simulated Modbus line has ended");
      got += static_cast<std::size_t>(count);
    }
    return {};
  }
  double TrueFocus() override {
    return bus_.With(kUnit, [](sim::ModbusDrive& drive, Duration now) { return drive.shaft().CountAt(now); });
  }

 private:
  std::string Port() const { return folder_ + "/port"; }
  Result<void> Serve() {
    if (served_) return {};
    if (wire_ == Wire::Rtu) {
      if (auto served = bus_.ServeRtu(Port()); !served) return served;
    } else {
      const auto served = bus_.ServeTcp(0);
      if (!served) return PassOn(served);
      port_ = *served;
    }
    served_ = true;
    return {};
  }
  int OpenTerminal() const {
    const int fd = ::open(Port().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    if (fd >= 0 && ::tcgetattr(fd, &raw) == 0) {
      ::cfmakeraw(&raw);
      ::tcsetattr(fd, TCSANOW, &raw);
    }
    return fd;
  }
  int Connect() const {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), on = 1;
    ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port_));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    (void)::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    return fd;
  }

  const Wire wire_;
  sim::ModbusBus bus_;
  std::string folder_;
  int port_ = 0;
  int bare_ = -1;
  bool served_ = false;
  std::mt19937_64 seeds_{kWeatherSeed};
};

}  // namespace

std::unique_ptr<DriverStand> MakeModbusTcpStand(const Weather& weather) {
  return std::make_unique<ModbusStand>(Wire::Tcp, weather);
}
std::unique_ptr<DriverStand> MakeModbusRtuStand(const Weather& weather) {
  return std::make_unique<ModbusStand>(Wire::Rtu, weather);
}

}  // namespace lensd::bench
