// How much memory this process holds: for tests that look for leaks.
#pragma once

#include <unistd.h>

#include <fstream>

namespace lensd::testing {

/// Resident set in kilobytes.
inline long ResidentKilobytes() {
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  file >> total >> resident;
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

}  // namespace lensd::testing
