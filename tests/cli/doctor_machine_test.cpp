// What doctor says of a machine, held against folders that look like /sys and /proc.
#include "cli/online/setup/doctor_machine.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <string>

namespace lensd::cli {
namespace {

namespace fs = std::filesystem;

class DoctorMachine : public testing::Test {
 protected:
  DoctorMachine() {
    std::string name = (fs::temp_directory_path() / "lensd-doctor-XXXXXX").string();
    root_ = mkdtemp(name.data());
  }
  ~DoctorMachine() override { fs::remove_all(root_); }

  void Write(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text << "\n";
  }
  void Card(const std::string& name, const std::string& type, const std::string& state, const std::string& mtu) {
    Write("sys/class/net/" + name + "/type", type);
    Write("sys/class/net/" + name + "/operstate", state);
    Write("sys/class/net/" + name + "/mtu", mtu);
  }
  /// Whether there is a finding of that status whose message has these words.
  bool Says(const std::set<std::string>& drivers, const std::string& status, const std::string& words,
            const std::vector<std::string>& nodes = {}) {
    Findings findings;
    CheckMachine(drivers, nodes, root_, findings);
    for (const auto& finding : findings.json()) {
      if (finding["status"] == status && finding["message"].get<std::string>().contains(words)) return true;
    }
    return false;
  }

  fs::path root_;
};

TEST_F(DoctorMachine, NamesTheModuleThatIsNotLoaded) {
  EXPECT_TRUE(Says({"v4l2"}, "problem", "video4linux"));
  EXPECT_FALSE(Says({"sim"}, "problem", "video4linux"));
  fs::create_directories(root_ / "sys/class/video4linux");
  EXPECT_FALSE(Says({"v4l2"}, "problem", "video4linux"));
}

TEST_F(DoctorMachine, WarnsOfSmallPacketsAndBuffersWhereThereIsANetworkCamera) {
  Card("eth7", "1", "up", "1500");
  Card("eth8", "1", "up", "9000");
  Card("eth9", "1", "down", "1500");
  Card("lo", "772", "up", "65536");
  Write("proc/sys/net/core/rmem_max", "212992");
  EXPECT_TRUE(Says({"aravis"}, "warning", "eth7 carries packets of 1500"));
  EXPECT_TRUE(Says({"aravis"}, "ok", "eth8 carries packets of 9000"));
  EXPECT_FALSE(Says({"aravis"}, "warning", "eth9"));
  EXPECT_FALSE(Says({"aravis"}, "warning", "lo carries"));
  EXPECT_TRUE(Says({"aravis"}, "warning", "212992 bytes at most"));
  EXPECT_FALSE(Says({"uvc", "v4l2"}, "warning", "212992"));
  Write("proc/sys/net/core/rmem_max", "33554432");
  EXPECT_FALSE(Says({"aravis"}, "warning", "bytes at most"));
}

TEST_F(DoctorMachine, WarnsOfASlowClock) {
  const std::string source = "sys/devices/system/clocksource/clocksource0/current_clocksource";
  Write(source, "acpi_pm");
  EXPECT_TRUE(Says({}, "warning", "acpi_pm"));
  Write(source, "tsc");
  EXPECT_TRUE(Says({}, "ok", "tsc"));
}

TEST_F(DoctorMachine, NamesWhoElseHasADeviceOpen) {
  for (const auto& [process, name] : {std::pair("12", "guvcview"), std::pair("13", "lensd"), std::pair("self", "x")}) {
    Write("proc/" + std::string(process) + "/comm", name);
    fs::create_directories(root_ / "proc" / process / "fd");
    fs::create_symlink("/dev/video3", root_ / "proc" / process / "fd/7");
  }
  EXPECT_TRUE(
      Says({"v4l2"}, "warning", "/dev/video3 is open in guvcview (process 12) too", {"/dev/video3", "10.0.0.2"}));
  EXPECT_FALSE(Says({"v4l2"}, "warning", "lensd", {"/dev/video3"}));
  EXPECT_FALSE(Says({"v4l2"}, "warning", "is open in", {"/dev/video4"}));
}

}  // namespace
}  // namespace lensd::cli
