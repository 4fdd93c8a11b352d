// A stepped clock goes where it is told, and never back.
#include "base/clock.h"

#include <gtest/gtest.h>

namespace lensd {
namespace {

using std::chrono::milliseconds;

TEST(SteppedClock, MovesOnlyWhenTold) {
  SteppedClock clock;
  const Instant start = clock.Now();
  EXPECT_EQ(clock.Now(), start);
  clock.Advance(milliseconds(5));
  EXPECT_EQ(clock.Now() - start, milliseconds(5));
}

TEST(SteppedClock, NeverGoesBack) {
  SteppedClock clock;
  clock.Advance(milliseconds(10));
  clock.AdvanceTo(Instant{milliseconds(3)});
  EXPECT_EQ(clock.Now(), Instant{milliseconds(10)});
  clock.AdvanceTo(Instant{milliseconds(12)});
  EXPECT_EQ(clock.Now(), Instant{milliseconds(12)});
}

}  // namespace
}  // namespace lensd
