// How much a randomised test should do: script/test sets LENSD_TEST_LEVEL to fast, ci or long.
#pragma once

#include <cstdlib>
#include <string_view>

namespace lensd::testing {

/// Picks a count by the level asked for; ci when nothing is said.
inline long ByLevel(long fast, long ci, long long_run) {
  const char* level = std::getenv("LENSD_TEST_LEVEL");
  if (level == nullptr || std::string_view(level) == "ci") return ci;
  return std::string_view(level) == "long" ? long_run : fast;
}

}  // namespace lensd::testing
