// Cameras on USB are opened by another process first. There is no such camera here: in its place Aravis' own simulated
// device, and programs that crash, spin, fail or answer in the place of that process.
#include "trial.h"

#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <random>
#include <string>

#include "camera_search.h"
#include "drivers/aravis/driver.h"
#include "gobject_handles.h"
#include "test_level.h"

namespace lensd::drivers::aravis {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

Result<void> Shell(const std::string& script, Duration limit) {
  return RunTrial({"/bin/sh", "-c", script}, limit);
}

TEST(UsbTrial, EveryEndHasItsWords) {
  std::mt19937 random(20261127);
  constexpr int kSignals[] = {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGTRAP, SIGILL, SIGKILL};
  const int count = lensd::testing::ByLevel(20, 60, 1'000);
  for (int i = 0; i < count; ++i) {
    const int signal = kSignals[random() % std::size(kSignals)], status = 1 + static_cast<int>(random() % 255);
    switch (random() % 4) {
      case 0:
        EXPECT_TRUE(Shell("echo said; echo wrong >&2", 60s));
        break;
      case 1: {
        const auto crashed = Shell("kill -" + std::to_string(signal) + " $$; sleep 60", 60s);
        ASSERT_FALSE(crashed);
        EXPECT_EQ(crashed.error().message, std::string("crashed (") + strsignal(signal) + ")");
        EXPECT_EQ(crashed.error().code, Code::Unsupported);
        break;
      }
      case 2: {
        const auto failed = Shell("exit " + std::to_string(status), 60s);
        ASSERT_FALSE(failed);
        EXPECT_EQ(failed.error().message, "failed with status " + std::to_string(status));
        break;
      }
      default: {
        // It spins, and takes no notice of being asked to end.
        const auto spun = Shell("trap '' TERM INT HUP; while :; do :; done", 20ms);
        ASSERT_FALSE(spun);
        EXPECT_EQ(spun.error().message, "did not end within 20 ms");
      }
    }
  }
  const auto none = RunTrial({"/nowhere/lensd"}, 1s);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Code::Io);
}

/// What a camera of that id does to the process that opens it first.
class UsbCamera : public ::testing::Test {
 protected:
  void SetUp() override {
    TameGlib();
    arv_disable_interface("GigEVision");
    arv_enable_interface("Fake");
    program_ = ::testing::TempDir() + "lensd-trial-" + std::to_string(getpid()) + ".sh";
  }
  void TearDown() override {
    TryUsbCamerasBy("");
    unlink(program_.c_str());
  }
  Result<OpenedCamera> Open(const std::string& script) {
    std::ofstream(program_) << "#!/bin/sh\n[ \"$1 $2\" = '--try-usb-camera Fake_1' ] || exit 9\n" << script << "\n";
    chmod(program_.c_str(), 0700);
    TryUsbCamerasBy(program_);
    ListedCamera listed;
    listed.id = "Fake_1";
    listed.protocol = "USB3Vision";
    return OpenListed(listed);
  }
  std::string program_;
};

TEST_F(UsbCamera, IsOpenedWhereTheOtherProcessCouldOpenIt) {
  const auto opened = Open("exit 0");
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_NE(opened->camera, nullptr);
}

TEST_F(UsbCamera, IsRefusedWithTheReasonWhereTheOtherProcessCrashes) {
  const auto crashed = Open("kill -SEGV $$");
  ASSERT_FALSE(crashed);
  EXPECT_EQ(crashed.error().code, Code::Unsupported);  // `devices` shows it as the problem of this camera
  EXPECT_THAT(crashed.error().message, HasSubstr("the camera with id \"Fake_1\" is not used"));
  EXPECT_THAT(crashed.error().message, HasSubstr("the process that tried it crashed (Segmentation fault)"));
}

TEST_F(UsbCamera, IsRefusedWithTheReasonWhereTheOtherProcessNeverEnds) {
  const auto spun = Open("while :; do :; done");
  ASSERT_FALSE(spun);
  EXPECT_THAT(spun.error().message, HasSubstr("the process that tried it did not end within 4000 ms"));
}

}  // namespace
}  // namespace lensd::drivers::aravis
