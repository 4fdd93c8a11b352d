// What a driver prints is passed on line by line, at most 100 lines a second.
#include <string>
#include <vector>

#include "host_process.h"
#include "odd_device.h"

namespace lensd::drivers::process {

TEST(PrintedLines, ComeWholeHoweverTheReadsFall) {
  std::vector<std::string> log;
  PrintedLines lines([&](std::string_view line) { log.emplace_back(line); });
  const std::string text = "one\n\n  \ntwo\x1b[31m\nthree";
  for (const char c : text) lines.Take({&c, 1}, Instant{});
  lines.End(Instant{});
  EXPECT_EQ(log, (std::vector<std::string>{"one", "two [31m", "three"}));
  EXPECT_EQ(lines.Last(), "; it printed last: one | two [31m | three");
}

TEST(PrintedLines, AreAtMostAHundredASecondAndTheOthersAreCounted) {
  std::vector<std::string> log;
  PrintedLines lines([&](std::string_view line) { log.emplace_back(line); });
  Instant now{std::chrono::seconds(5)};
  for (int i = 0; i < 1000; ++i) lines.Take("x\n", now);
  EXPECT_EQ(log.size(), 100u);
  now += std::chrono::seconds(1);
  lines.Take("y\n", now);
  ASSERT_EQ(log.size(), 102u);
  EXPECT_EQ(log[100], "(900 more lines were printed)");
  EXPECT_EQ(log[101], "y");
  lines.End(now);
}

TEST(PrintedLines, ALongLineIsCut) {
  std::vector<std::string> log;
  PrintedLines lines([&](std::string_view line) { log.emplace_back(line); });
  lines.Take(std::string(1'000'000, 'x'), Instant{});
  lines.Take("\n", Instant{});
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0], std::string(PrintedLines::kLongestLine, 'x'));
  lines.End(Instant{});
}

}  // namespace lensd::drivers::process
