// Optics in exact rational arithmetic, from the formulas as they stand in a textbook: the independent truth the tests
// compare against. Doubles enter as the exact numbers they are.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

namespace lensd::optics::testing {

using Exact = boost::multiprecision::cpp_rational;

/// |got - truth| / |truth|, or |got| where the truth is zero.
inline double RelativeError(double got, const Exact& truth) {
  const Exact error = abs(Exact(got) - truth);
  return truth == 0 ? static_cast<double>(error) : static_cast<double>(Exact(error / abs(truth)));
}

/// The error in units of the last place of `got`.
inline double UlpError(double got, const Exact& truth) {
  const double ulp = std::nextafter(std::abs(got), INFINITY) - std::abs(got);
  return static_cast<double>(Exact(abs(Exact(got) - truth) / Exact(ulp)));
}

inline Exact ExtensionFromDistance(const Exact& f, const Exact& z) {
  return 1 / (1 / f - 1 / z) - f;
}
inline Exact ExtensionFromVergence(const Exact& f, const Exact& u) {
  return 1 / (1 / f - u) - f;
}

/// s = A (Z_s (P - U) - 1).
inline Exact SignedBlur(const Exact& f, const Exact& n, const Exact& e, const Exact& u) {
  return f / n * ((f + e) * (1 / f - u) - 1);
}

/// Random lenses and subjects over the whole legal range, most of them where digits get lost.
class Draw {
 public:
  explicit Draw(unsigned seed) : engine_(seed) {}

  double Uniform(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  double Log(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  bool Coin() { return Uniform(0.0, 1.0) < 0.5; }
  double FocalLength() { return Log(1e-3, 2.0); }
  double FNumber() { return Log(0.5, 90.0); }
  /// A distance with Z/f - 1 from 1e-9 to 1e12.
  double Beyond(double focal_length) { return focal_length * (1.0 + Log(1e-9, 1e12)); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace lensd::optics::testing
