// The response is tabulated once, on first use, and interpolated; any thread may ask.
#include "defocus/disk_response.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace lensd::autofocus::defocus {
namespace {

constexpr double kStep = 1.0 / 256.0;  // turns: an interpolation error below 1e-5
constexpr int kEntries = 200 * 256 + 2;

/// Bessel's J1, by Hankel's expansion where the library's series would be slow: within 1e-8 from 20 on.
double BesselJ1(double x) {
  if (x < 20.0) return std::cyl_bessel_j(1.0, x);
  const double y = 1.0 / (x * x);
  const double even = 1.0 + y * (15.0 / 128.0 - y * 4725.0 / 32768.0);
  const double odd = (3.0 / 8.0 - y * 105.0 / 1024.0) / x;
  const double phase = x - 0.75 * std::numbers::pi;
  return std::sqrt(2.0 / (std::numbers::pi * x)) * (even * std::cos(phase) - odd * std::sin(phase));
}

std::vector<float> Tabulate() {
  std::vector<float> table(kEntries, 1.0f);
  for (int i = 1; i < kEntries; ++i) {
    const double x = std::numbers::pi * kStep * i;
    table[static_cast<std::size_t>(i)] = static_cast<float>(2.0 * BesselJ1(x) / x);
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
