// What a driver's process may not do, tried by a driver that does it (confined_driver.cpp). Sockets are also made here:
// a family that this machine refuses to everybody is refused with the machine's own answer.
#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>

#include "loop/descriptor.h"
#include "odd_device.h"

namespace lensd::drivers::process {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

/// A pseudo terminal: a device that nobody else uses.
class Terminal {
 public:
  Terminal() : master_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    char name[64];
    if (!master_ || grantpt(master_.get()) != 0 || unlockpt(master_.get()) != 0 ||
        ptsname_r(master_.get(), name, sizeof name) != 0) {
      ADD_FAILURE() << "no pseudo terminal";
    } else {
      path_ = name;
    }
  }
  const std::string& path() const { return path_; }

 private:
  daemon::Descriptor master_;
  std::string path_;
};

class ConfinementTest : public ::testing::Test {
 protected:
  ConfinementTest() {
    std::string name = (std::filesystem::temp_directory_path() / "lensd-confined-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
    folder_ = name;
    std::ofstream(File()) << "a file of lensd's\n";
  }
  ~ConfinementTest() override { std::filesystem::remove_all(folder_); }

  std::string File() const { return folder_ + "/file"; }

  /// What it was answered, by what it tried.
  std::map<std::string, std::string> Answers(const std::string& network) {
    Settings::Table table;
    for (const auto& [key, path] : {std::pair{"allowed", mine_.path()}, {"other", other_.path()}, {"file", File()}}) {
      table.emplace(key, Settings(path, {"bench.toml", 1}));
    }
    const auto device = OpenInProcess(
        {.command = {LENSD_BINARY_DIR "/tests/confined-driver", network, mine_.path()}, .driver = "probe"},
        Settings(std::move(table), {"bench.toml", 1}), clock_);
    if (!device) {
      ADD_FAILURE() << device.error().message;
      return {};
    }
    std::map<std::string, std::string> answers;
    for (const std::string& doubt : device->findings.doubts()) {
      const auto colon = doubt.find(": ");
      answers[doubt.substr(0, colon)] = doubt.substr(colon + 2);
    }
    return answers;
  }

  Terminal mine_, other_;
  MonotonicClock clock_;

 private:
  std::string folder_;
};

TEST_F(ConfinementTest, ADriverMakesSocketsOfItsFamiliesAlone) {
  for (const bool network : {false, true}) {
    std::set<int> allowed = {AF_UNIX, AF_NETLINK};
    if (network) allowed.insert({AF_INET, AF_INET6});
    auto answers = Answers(network ? "network" : "none");
    for (int family = 0; family < AF_MAX; ++family) {
      errno = 0;
      const daemon::Descriptor here(socket(family, SOCK_DGRAM, 0));
      const std::string without = here ? "done" : strerrorname_np(errno);
      EXPECT_EQ(answers["socket " + std::to_string(family)], allowed.contains(family) ? without : "EAFNOSUPPORT")
          << "network " << network;
    }
  }
}

TEST_F(ConfinementTest, ADriverHasItsOwnMemoryAndProcessAlone) {
  auto answers = Answers("none");
  if (!kSanitized) {
    EXPECT_EQ(answers["2 GiB"], "ENOMEM");
  }
  EXPECT_EQ(answers["execve"], "EPERM");
  EXPECT_EQ(answers["ptrace the parent"], "EPERM");
  EXPECT_EQ(answers["kill the parent"], "EPERM");
  EXPECT_EQ(answers["kill itself"], "done");
}

TEST_F(ConfinementTest, ADriverOpensItsOwnDeviceAloneAndWritesNoFile) {
  if (syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) < 1) {
    GTEST_SKIP() << "this kernel has no Landlock";
  }
  auto answers = Answers("none");
  for (const std::string how : {"read ", "write "}) {
    EXPECT_EQ(answers[how + mine_.path()], "done");
    EXPECT_EQ(answers[how + other_.path()], "EACCES");
  }
  EXPECT_EQ(answers["read " + File()], "done");
  EXPECT_EQ(answers["write " + File()], "EACCES");
  EXPECT_EQ(answers["write " + File() + ".new"], "EACCES");
  EXPECT_EQ(answers["write /dev/null"], "done");
}

}  // namespace
}  // namespace lensd::drivers::process
