// How much memory this process holds: for tests that look for leaks.
#pragma once

#include <unistd.h>

#include <fstream>

namespace lensd::testing {

/// Resident set in kilobytes; always 0 under sanitizers, which keep what was freed (LeakSanitizer looks for leaks
/// there).
inline long ResidentKilobytes() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 0;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  return 0;
#endif
#endif
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  file >> total >> resident;
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

}  // namespace lensd::testing
