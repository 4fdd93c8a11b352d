// A disk that hangs while positions are written and comes back when another store writes them: the newest stay.
#include "daemon/state/position_store.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <condition_variable>
#include <filesystem>
#include <iterator>
#include <mutex>
#include <string>
#include <thread>

namespace {

/// A flush that hangs, once, until it is let go.
class Disk {
 public:
  void HangNext() { Set(State::HangsNext); }
  void ComeBack() { Set(State::Works); }
  void WaitUntilItHangs() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return state_ == State::Hangs; });
  }
  void Flush() {
    std::unique_lock lock(mutex_);
    if (state_ != State::HangsNext) return;
    state_ = State::Hangs;
    changed_.notify_all();
    changed_.wait(lock, [&] { return state_ == State::Works; });
  }

 private:
  enum class State { Works, HangsNext, Hangs };
  void Set(State state) {
    const std::lock_guard lock(mutex_);
    state_ = state;
    changed_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::Works;
};

Disk& TheDisk() {
  static Disk disk;
  return disk;
}

}  // namespace

/// Takes the place of the C library's.
extern "C" int fsync(int) {
  TheDisk().Flush();
  return 0;
}

namespace lensd::daemon {
namespace {

using Axes = rig::PositionMemory::Axes;

Axes FocusAt(double position) {
  Axes axes;
  rig::AxisMemory focus;
  focus.position = Native{position};
  axes[drivers::Axis::Focus] = focus;
  return axes;
}

double FocusOf(const Result<Axes>& axes) {
  EXPECT_TRUE(axes.has_value());
  return axes && (*axes)[drivers::Axis::Focus] ? (*axes)[drivers::Axis::Focus]->position.value : -1.0;
}

class Folder {
 public:
  Folder() { path_ = mkdtemp(name_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }
  long files() const { return std::distance(std::filesystem::directory_iterator(path_), {}); }

 private:
  char name_[32] = "/tmp/lensd-positions-XXXXXX";
  std::string path_;
};

TEST(PositionStore, WhoWasGivenUpPutsNothingOldInTheNewestsPlace) {
  const Folder folder;
  const auto given_up = std::make_shared<StopSignal>();
  {
    PositionStore old(folder.path(), "a", "", given_up);
    ASSERT_TRUE(old.Save(FocusAt(1.0)));
    TheDisk().HangNext();
    std::jthread saver([&] { EXPECT_FALSE(old.Save(FocusAt(2.0))); });
    TheDisk().WaitUntilItHangs();
    given_up->Sever();
    saver.join();
    PositionStore next(folder.path(), "a", "", std::make_shared<StopSignal>());
    EXPECT_EQ(FocusOf(next.Load()), 1.0);
    EXPECT_TRUE(next.Save(FocusAt(3.0)));
    TheDisk().ComeBack();
  }  // both have written what they ever will
  PositionStore last(folder.path(), "a", "", std::make_shared<StopSignal>());
  EXPECT_EQ(FocusOf(last.Load()), 3.0);
  EXPECT_EQ(folder.files(), 1) << "a temporary file was left";
}

/// Who warns of a file that cannot be read and who goes by it hear the same of a disk that fails now and then.
TEST(PositionStore, WhatWasReadOnceIsNotReadAgain) {
  const Folder folder;
  const std::string path = [&] {
    PositionStore before(folder.path(), "a", "", std::make_shared<StopSignal>());
    EXPECT_TRUE(before.Save(FocusAt(1.0)));
    return before.path();
  }();
  PositionStore store(folder.path(), "a", "", std::make_shared<StopSignal>());
  EXPECT_EQ(FocusOf(store.Load()), 1.0);
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  EXPECT_EQ(FocusOf(store.Load()), 1.0);
}

}  // namespace
}  // namespace lensd::daemon
