// A file is always whole, whatever goes wrong while it is replaced.
#include "io/atomic_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

namespace lensd::io {
namespace {

namespace fs = std::filesystem;

class AtomicFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "lensd-atomic-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string In(const char* name) const { return (folder_ / name).string(); }
  std::ptrdiff_t Files() const { return std::distance(fs::directory_iterator(folder_), fs::directory_iterator()); }

  fs::path folder_;
};

TEST_F(AtomicFileTest, WritesAndReplacesAndLeavesNothingElse) {
  ASSERT_TRUE(WriteFileAtomically(In("state.toml"), "one"));
  EXPECT_EQ(*ReadWholeFile(In("state.toml")), "one");
  const std::string large(3 << 20, 'x');
  ASSERT_TRUE(WriteFileAtomically(In("state.toml"), large));
  EXPECT_EQ(*ReadWholeFile(In("state.toml")), large);
  ASSERT_TRUE(WriteFileAtomically(In("state.toml"), ""));
  EXPECT_EQ(*ReadWholeFile(In("state.toml")), "");
  EXPECT_EQ(Files(), 1);
}

TEST_F(AtomicFileTest, KeepsPermissionsAndFollowsLinks) {
  ASSERT_TRUE(WriteFileAtomically(In("real"), "one"));
  ASSERT_EQ(chmod(In("real").c_str(), 0640), 0);
  fs::create_symlink("real", In("link"));
  ASSERT_TRUE(WriteFileAtomically(In("link"), "two"));
  EXPECT_TRUE(fs::is_symlink(In("link")));
  EXPECT_EQ(*ReadWholeFile(In("real")), "two");
  EXPECT_EQ(static_cast<int>(fs::status(In("real")).permissions()), 0640);
}

TEST_F(AtomicFileTest, SaysWhatIsWrong) {
  const auto nowhere = WriteFileAtomically(In("absent/file"), "x");
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, Code::Io);
  EXPECT_NE(nowhere.error().message.find("absent/file"), std::string::npos) << nowhere.error().message;
  fs::create_directory(In("folder"));
  EXPECT_EQ(WriteFileAtomically(In("folder"), "x").error().code, Code::Io);
  EXPECT_EQ(Files(), 1);
  EXPECT_EQ(ReadWholeFile(In("nothing")).error().code, Code::Io);
  EXPECT_EQ(ReadWholeFile(In("folder")).error().code, Code::Io);
  ASSERT_TRUE(WriteFileAtomically(In("long"), "12345"));
  EXPECT_EQ(ReadWholeFile(In("long"), 4).error().code, Code::BadData);
}

// A disk that is full in the middle: the old file stays, no temporary one does.
TEST_F(AtomicFileTest, AFailedWriteLeavesTheOldFile) {
  ASSERT_TRUE(WriteFileAtomically(In("state"), "old"));
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit small{1 << 12, 1 << 12};
    setrlimit(RLIMIT_FSIZE, &small);
    const auto written = WriteFileAtomically(In("state"), std::string(1 << 16, 'x'));
    _exit(!written && written.error().code == Code::Io ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(*ReadWholeFile(In("state")), "old");
  EXPECT_EQ(Files(), 1);
}

// Killed at any moment: one of the two contents, whole.
TEST_F(AtomicFileTest, KilledWhileWritingTheFileIsWhole) {
  const std::string one(200000, '1'), two(300000, '2');
  ASSERT_TRUE(WriteFileAtomically(In("state"), one));
  for (int i = 0; i < 20; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      for (;;) {
        if (!WriteFileAtomically(In("state"), two) || !WriteFileAtomically(In("state"), one)) _exit(1);
      }
    }
    std::this_thread::sleep_for(std::chrono::microseconds(1500 + 700 * i));
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    const auto found = ReadWholeFile(In("state"));
    ASSERT_TRUE(found);
    EXPECT_TRUE(*found == one || *found == two);
  }
}

}  // namespace
}  // namespace lensd::io
