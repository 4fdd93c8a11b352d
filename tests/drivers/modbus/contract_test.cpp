// The contract suite on simulated drives, over TCP and over RTU on a pseudo-terminal.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

#include "drivers/process/process.h"
#include "modbus_bench.h"
#include "stand.h"

namespace lensd::drivers::modbus {
namespace {

/// The simulator as a program: on TCP its ends of the connections would count as files that the driver leaves open.
class Program {
 public:
  explicit Program(const std::string& profile) {
    int input[2], output[2];
    if (pipe2(input, O_CLOEXEC) != 0 || pipe2(output, O_CLOEXEC) != 0) abort();
    const std::string path = LENSD_BINARY_DIR "/bin/sim-modbus-drive";
    const std::string one = "1:" + profile, two = "2:" + profile;
    child_ = fork();
    if (child_ == 0) {
      dup2(input[0], STDIN_FILENO);
      dup2(output[1], STDOUT_FILENO);
      execl(path.c_str(), path.c_str(), "--tcp", "0", "--unit", one.c_str(), "--unit", two.c_str(), nullptr);
      _exit(127);
    }
    close(input[0]);
    close(output[1]);
    to_ = fdopen(input[1], "w");
    from_ = fdopen(output[0], "r");
    const std::string greeting = Line();
    port = greeting.substr(greeting.find(':') + 1);
  }
  ~Program() {
    Tell("quit");
    fclose(to_);
    fclose(from_);
    waitpid(child_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void Tell(const std::string& command) {
    fputs((command + "\n").c_str(), to_);
    fflush(to_);
  }
  std::string Line() {
    char line[256] = "";
    EXPECT_NE(fgets(line, sizeof line, from_), nullptr) << "the simulator is gone";
    line[strcspn(line, "\n")] = '\0';
    return line;
  }
  std::string port;

 private:
  pid_t child_ = -1;
  FILE* to_ = nullptr;
  FILE* from_ = nullptr;
};

std::string TwoDrives(const std::string& profile, const std::string& keys) {
  std::string drives;
  for (const auto& [axis, unit] : {std::pair{"focus", 1}, {"iris", 2}}) {
    drives.append("[drives.").append(axis).append("]\nunit = ").append(std::to_string(unit));
    drives.append("\nprofile = \"").append(profile).append("\"\n").append(keys);
  }
  return drives;
}

/// A lens of two drives on a serial line.
class RtuStand : public contract::RealStand {
 public:
  RtuStand(const std::string& profile, const std::string& keys)
      : bench_(true, {profile, profile}), drives_(TwoDrives(profile, keys)) {}

  Result<Device> Open() override { return bench_.Open(drives_); }
  bool Unplug() override {
    bench_.wire.Unplug();
    return true;
  }
  void Plug() override { bench_.Plug(); }

 private:
  Bench bench_;
  const std::string drives_;
};

class TcpStand : public contract::RealStand {
 public:
  TcpStand(const std::string& profile, const std::string& keys)
      : program_(profile), drives_(TwoDrives(profile, keys)) {}

  Result<Device> Open() override {
    const auto settings = io::ParseToml(
        "[bus]\nname = \"bench\"\nhost = \"127.0.0.1:" + program_.port + "\"\n" + kPatient + "\n" + drives_,
        "bench.toml");
    if (!settings) return PassOn(settings);
    return OpenModbus(WithShippedProfiles(*settings), clock());
  }
  bool Unplug() override {
    program_.Tell("unplug");
    return program_.Line() == "ok";
  }
  void Plug() override {
    program_.Tell("plug");
    EXPECT_EQ(program_.Line(), "listening on 127.0.0.1:" + program_.port);
  }

 private:
  Program program_;
  const std::string drives_;
};

class MoonsOnTcp final : public TcpStand {
 public:
  MoonsOnTcp() : TcpStand("moons", "range = [0, 10000]\nparameters = { speed = 960, home_speed = 960 }\n") {}
};

class AzOnRtu final : public RtuStand {
 public:
  AzOnRtu()
      : RtuStand("oriental-az",
                 "range = [-500, 10000]\nparameters = { speed = 50000, start_rate = 1000000, stop_rate = 1000000 }\n") {
  }
};

/// The driver in a process of its own.
class AzInProcess final : public contract::RealStand {
 public:
  Result<Device> Open() override {
    const auto settings =
        io::ParseToml("[bus]\nname = \"bench\"\ndevice = \"" + bench_.port() + "\"\n" + kPatient + "\n" +
                          TwoDrives("oriental-az",
                                    "range = [-500, 10000]\n"
                                    "parameters = { speed = 50000, start_rate = 1000000, stop_rate = 1000000 }\n"),
                      "bench.toml");
    if (!settings) return PassOn(settings);
    return process::OpenInProcess(
        {.command = {LENSD_BINARY_DIR "/bin/lensd-driver", "modbus", bench_.port()}, .driver = "modbus"},
        WithShippedProfiles(*settings), clock());
  }
  bool Unplug() override {
    bench_.wire.Unplug();
    return true;
  }
  void Plug() override { bench_.Plug(); }

 private:
  Bench bench_{true, {"oriental-az", "oriental-az"}};
};

class LeadshineOnRtu final : public RtuStand {
 public:
  LeadshineOnRtu() : RtuStand("leadshine-rs", "range = [0, 10000]\nparameters = { speed = 400 }\n") {}
};

class GenericOnTcp final : public TcpStand {
 public:
  GenericOnTcp() : TcpStand("generic", "range = [0, 8000]\nparameters = { speed = 40000 }\n") {}
};

}  // namespace
}  // namespace lensd::drivers::modbus

namespace lensd {

using namespace drivers::modbus;

INSTANTIATE_TEST_SUITE_P(MoonsOnTcp, LensContract, contract::Stands<MoonsOnTcp>());
INSTANTIATE_TEST_SUITE_P(AzOnRtu, LensContract, contract::Stands<AzOnRtu>());
INSTANTIATE_TEST_SUITE_P(AzInProcess, LensContract, contract::Stands<AzInProcess>());
INSTANTIATE_TEST_SUITE_P(LeadshineOnRtu, LensContract, contract::Stands<LeadshineOnRtu>());
INSTANTIATE_TEST_SUITE_P(GenericOnTcp, LensContract, contract::Stands<GenericOnTcp>());

}  // namespace lensd
