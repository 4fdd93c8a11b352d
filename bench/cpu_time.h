// Time of the calling thread alone: what a single-threaded comparison asks for, whatever other programs run.
#pragma once

#include <ctime>

#include <algorithm>
#include <limits>
#include <vector>

namespace lensd::bench {

/// CPU time of this thread so far, in milliseconds.
inline double ThreadCpuMs() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// The median of `repeats` runs of `work`, each after `prepare`, in milliseconds of CPU.
template <class Prepare, class Work>
double MedianCpuMs(int repeats, Prepare prepare, Work work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    prepare();
    const double start = ThreadCpuMs();
    work();
    times.push_back(ThreadCpuMs() - start);
  }
  std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
  return times[static_cast<std::size_t>(repeats) / 2];
}

}  // namespace lensd::bench
