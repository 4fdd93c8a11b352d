// A turn that is taken for as long as open() lasts, and not waited for without end.
#include "drivers/hotplug/waking.h"

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace lensd::drivers::hotplug {
namespace {

constexpr auto kLongestWait = std::chrono::seconds(3);

class Turn {
 public:
  /// False: somebody has had it for so long that it is not waited for any more.
  bool Take() {
    std::unique_lock lock(mutex_);
    if (!given_back_.wait_for(lock, kLongestWait, [this] { return !taken_; })) return false;
    taken_ = true;
    return true;
  }
  void GiveBack() {
    {
      const std::lock_guard lock(mutex_);
      taken_ = false;
    }
    given_back_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable given_back_;
  bool taken_ = false;  // guarded by mutex_
};

}  // namespace

int OpenInTurn(const std::function<int()>& open) {
  static Turn turn;
  const bool taken = turn.Take();
  const int opened = open();
  const int error = errno;
  if (taken) turn.GiveBack();
  errno = error;
  return opened;
}

}  // namespace lensd::drivers::hotplug
