// Device nodes are opened one after the other: what the kernel makes of two that are opened at once is in the virtual
// bench (two_cameras_test.py).
#include "drivers/hotplug/waking.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "test_level.h"

namespace lensd::drivers::hotplug {
namespace {

/// A bus as vhci_hcd has it: a device that is woken while another one wakes is lost.
class Bus {
 public:
  int Open() {
    const bool alone = waking_.fetch_add(1) == 0;
    std::this_thread::yield();
    std::this_thread::yield();
    const bool still_alone = waking_.fetch_sub(1) == 1;
    if (alone && still_alone) return 7;
    errno = EBUSY;
    return -1;
  }

 private:
  std::atomic<int> waking_{0};
};

TEST(Waking, TwoDevicesAtOnceAreOpenedOneAfterTheOther) {
  Bus bus;
  std::atomic<long> lost{0};
  const long count = testing::ByLevel(200, 2'000, 1'000'000);
  std::vector<std::jthread> lenses;
  for (int i = 0; i < 4; ++i) {
    lenses.emplace_back([&] {
      for (long k = 0; k < count; ++k) {
        if (OpenInTurn([&] { return bus.Open(); }) < 0) ++lost;
      }
    });
  }
  lenses.clear();
  EXPECT_EQ(lost, 0);
}

TEST(Waking, ErrnoIsLeftAsOpenLeftIt) {
  const auto refuse = [] {
    errno = EACCES;
    return -1;
  };
  EXPECT_EQ(OpenInTurn(refuse), -1);
  EXPECT_EQ(errno, EACCES);
}

TEST(Waking, AnOpeningThatHangsKeepsNobodyForEver) {
  if (testing::ByLevel(0, 0, 1) == 0) GTEST_SKIP() << "takes the 3 s that are waited for";
  std::promise<void> hangs, goes_on;
  std::jthread stuck([&] {
    OpenInTurn([&] {
      hangs.set_value();
      goes_on.get_future().wait();
      return 1;
    });
  });
  hangs.get_future().wait();
  EXPECT_EQ(OpenInTurn([] { return 2; }), 2);
  goes_on.set_value();
}

}  // namespace
}  // namespace lensd::drivers::hotplug
