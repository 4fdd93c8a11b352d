// The response is tabulated once, on first use, and interpolated; any thread may ask.
#include "defocus/disk_response.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace lensd::autofocus::defocus {
namespace {

constexpr double kStep = 1.0 / 256.0;  // turns: an interpolation error below 1e-5
constexpr int kEntries = 200 * 256 + 2;

std::vector<float> Tabulate() {
  std::vector<float> table(kEntries, 1.0f);
  for (int i = 1; i < kEntries; ++i) {
    const double x = std::numbers::pi * kStep * i;
    // Not std::cyl_bessel_j, which sets signgam, a variable of all threads.
    table[static_cast<std::size_t>(i)] = static_cast<float>(2.0 * ::j1(x) / x);
  }
  return table;
}

}  // namespace

double DiskResponse(double turns) {
  static const std::vector<float> table = Tabulate();
  const double at = std::abs(turns) * (1.0 / kStep);
  if (!(at < kEntries - 2)) return 0.0;
  const auto below = static_cast<std::size_t>(at);
  const double part = at - static_cast<double>(below);
  return table[below] + part * (table[below + 1] - table[below]);
}

}  // namespace lensd::autofocus::defocus
