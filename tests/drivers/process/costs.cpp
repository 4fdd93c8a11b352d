// What it costs that a driver is a process: one Read, and a stop while a Read hangs, inside and in a process by turns.
// Prints medians in us; `process_costs ROUNDS`.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <thread>
#include <vector>

#include "drivers/process/process.h"
#include "io/toml.h"
#include "odd_driver.h"

namespace {

using namespace lensd;
using drivers::Axis;

double Microseconds(Duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

const MonotonicClock kClock;

Result<drivers::Device> OpenOdd(const char* toml, bool own) {
  const auto settings = io::ParseToml(toml, "costs.toml");
  if (!settings) return PassOn(settings);
  if (!own) return testing::odd::Open(*settings, kClock);
  return drivers::process::OpenInProcess({.command = {LENSD_BINARY_DIR "/tests/odd-driver"}, .driver = "odd"},
                                         *settings, kClock);
}

double OneRead(drivers::Lens& lens) {
  const Instant begin = kClock.Now();
  if (!lens.Read()) std::exit(1);
  return Microseconds(kClock.Now() - begin);
}

/// From the moment at which a stop is wanted until it was carried out, as the worker of a lens does it. Below 0: the
/// Read had not begun yet.
double OneStop(drivers::Lens& lens) {
  std::atomic<bool> done = false;
  Instant stopped{};
  std::thread worker([&] {
    (void)lens.Read();
    if (!lens.Stop(Axis::Focus)) std::exit(1);
    stopped = kClock.Now();
    done = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const Instant begin = kClock.Now();
  int cuts = 0;
  while (!done) {
    lens.CutReadShort();
    ++cuts;
    for (int i = 0; i < 100 && !done; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  worker.join();
  return cuts == 1 ? Microseconds(stopped - begin) : -1.0;
}

template <class Measure>
void ByTurns(const char* what, const char* toml, int rounds, Measure measure) {
  auto inside = OpenOdd(toml, false);
  auto own = OpenOdd(toml, true);
  if (!inside || !own) std::exit(1);
  std::vector<double> of_inside, of_own;
  for (int i = 0; i < rounds; ++i) {
    const double one = measure(*inside->lens), other = measure(*own->lens);
    if (one < 0.0 || other < 0.0) continue;
    of_inside.push_back(one);
    of_own.push_back(other);
  }
  std::printf("%s: inside %.1f us, own process %.1f us, difference %.1f us (medians of %d)\n", what, Median(of_inside),
              Median(of_own), Median(of_own) - Median(of_inside), static_cast<int>(of_own.size()));
}

}  // namespace

int main(int count, char** words) {
  const int rounds = count > 1 ? std::atoi(words[1]) : 10000;
  ByTurns("Read", "", rounds, OneRead);
  ByTurns("a stop while a Read hangs", "in = \"Read\"\nhow = \"wait\"", std::max(rounds / 20, 10), OneStop);
  std::vector<double> starts;
  for (int i = 0; i < std::max(rounds / 100, 10); ++i) {
    const Instant begin = kClock.Now();
    auto device = OpenOdd("", true);
    if (!device) return 1;
    starts.push_back(Microseconds(kClock.Now() - begin));
  }
  std::printf("from exec to the description: %.1f us (median of %zu)\n", Median(starts), starts.size());
}
