// Exact decimal numbers, so that what a person wrote is what the verdict refers to: 33 in is 0.8382 m, not nearly.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lensd::cli {

/// sign * digits * 10^exponent with as many digits as it takes. Values parsed have at most 200 digits and exponents
/// within ±1000, so sums and products stay small.
class Decimal {
 public:
  Decimal() = default;
  /// An integer scaled by a power of ten: Decimal(254, -4) is 0.0254.
  Decimal(long long integer, int exponent);

  /// Reads the longest number that `text` begins with (`-1.2e-5`, `.5`, `+3`) and drops it from `text`; nullopt where
  /// there is none or it is longer than the caps above. An `e` counts only with digits after it.
  static std::optional<Decimal> TakeFrom(std::string_view& text);

  /// The shortest decimal that reads back as `value`, which must be finite.
  static Decimal Shortest(double value);

  friend Decimal operator+(const Decimal& a, const Decimal& b);
  friend Decimal operator-(const Decimal& a, const Decimal& b) { return a + b * Decimal(-1, 0); }
  friend Decimal operator*(const Decimal& a, const Decimal& b);

  friend bool operator<(const Decimal& a, const Decimal& b) { return (a - b).IsNegative(); }

  bool IsZero() const { return digits_.empty(); }
  bool IsNegative() const { return negative_; }
  bool IsPositive() const { return !negative_ && !IsZero(); }
  /// The nearest double, ties to even; nullopt where it overflows, or underflows to zero.
  std::optional<double> Nearest() const;
  /// "-12e-3": exact.
  std::string Text() const;

 private:
  void Normalise();

  bool negative_ = false;
  std::string digits_;  // most significant first, no leading or trailing zeros; empty is zero
  int exponent_ = 0;
};

}  // namespace lensd::cli
