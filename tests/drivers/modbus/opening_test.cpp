// What a person is told where a bus cannot be opened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "modbus_bench.h"

namespace lensd::drivers::modbus {
namespace {

/// The reason is a person's to act on.
TEST(ModbusBusMessages, SayWhyNothingCouldBeOpened) {
  const MonotonicClock clock;
  const auto why = [&](const std::string& wire) {
    const auto settings =
        io::ParseToml("[bus]\nname = \"b\"\nconnect_timeout_ms = 100\n" + wire + FastAz("focus", 1), "x");
    EXPECT_TRUE(settings.has_value());
    auto opened = OpenModbus(WithShippedProfiles(*settings), clock);
    EXPECT_FALSE(opened.has_value());
    return opened ? std::string() : opened.error().message;
  };
  EXPECT_THAT(why("device = \"/dev/null\"\n"), ::testing::HasSubstr("no serial port"));
  EXPECT_THAT(why("host = \"no-such-host.invalid\"\n"), ::testing::HasSubstr("there is no such host"));
  EXPECT_THAT(why("host = \"127.0.0.1:9\"\n"), ::testing::HasSubstr("nothing listens"));
  // A queue of connections that is full: the next one hears nothing.
  const int full = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof place;
  ASSERT_EQ(bind(full, reinterpret_cast<const sockaddr*>(&place), size), 0);
  ASSERT_EQ(listen(full, 0), 0);
  ASSERT_EQ(getsockname(full, reinterpret_cast<sockaddr*>(&place), &size), 0);
  std::vector<int> waiting;
  for (int i = 0; i < 4; ++i) {
    waiting.push_back(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    (void)connect(waiting.back(), reinterpret_cast<const sockaddr*>(&place), size);
  }
  EXPECT_THAT(why("host = \"127.0.0.1:" + std::to_string(ntohs(place.sin_port)) + "\"\n"),
              ::testing::HasSubstr("nothing there answers"));
  for (const int each : waiting) close(each);
  close(full);
}

}  // namespace
}  // namespace lensd::drivers::modbus
