// The response is tabulated once, on first use, and interpolated; any thread may ask.
#include "autofocus/defocus/disk_response.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace lensd::autofocus::defocus {
namespace {

// An interpolation error below 1e-5.
std::vector<double> Tabulate() {
  std::vector<double> table(kDiskResponseEntries, 1.0);
  for (int i = 1; i < kDiskResponseEntries; ++i) {
    const double x = std::numbers::pi * i / kDiskResponsePerTurn;
    // Not std::cyl_bessel_j, which sets signgam, a variable of all threads.
    table[static_cast<std::size_t>(i)] = 2.0 * ::j1(x) / x;
  }
  return table;
}

}  // namespace

const double* DiskResponseTable() {
  static const std::vector<double> table = Tabulate();
  return table.data();
}

double DiskResponse(double turns) {
  const double at = std::abs(turns) * kDiskResponsePerTurn;
  if (!(at < kDiskResponseEntries - 2)) return 0.0;
  const double* below = DiskResponseTable() + static_cast<std::size_t>(at);
  return below[0] + (at - std::floor(at)) * (below[1] - below[0]);
}

}  // namespace lensd::autofocus::defocus
