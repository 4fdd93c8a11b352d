// Exact decimal numbers, so that what a person wrote is what the verdict refers to: 33 in is 0.8382 m, not nearly.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace lensd::optics {

using Integer = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>, boost::multiprecision::et_off>;
using Rational =
    boost::multiprecision::number<boost::multiprecision::rational_adaptor<boost::multiprecision::cpp_int_backend<>>,
                                  boost::multiprecision::et_off>;

/// mantissa * 10^exponent.
class Decimal {
 public:
  Decimal() = default;
  /// An integer scaled by a power of ten: Decimal(254, -4) is 0.0254.
  explicit Decimal(Integer mantissa, int exponent = 0) : mantissa_(std::move(mantissa)), exponent_(exponent) {}

  /// Reads the longest number that `text` begins with (`-1.2e-5`, `.5`, `+3`) and drops it from `text`; nullopt where
  /// there is none or it has more than 200 digits or an exponent beyond ±1000, so that sums and products stay small. An
  /// `e` counts only with digits after it.
  static std::optional<Decimal> TakeFrom(std::string_view& text);
  /// All of `text`; nullopt where that is not one number.
  static std::optional<Decimal> Read(std::string_view text);
  /// The shortest decimal that reads back as `value`, which must be finite.
  static Decimal Shortest(double value);

  friend Decimal operator+(const Decimal& a, const Decimal& b);
  friend Decimal operator-(const Decimal& a, const Decimal& b) { return a + -b; }
  friend Decimal operator-(const Decimal& a) { return Decimal(-a.mantissa_, a.exponent_); }
  friend Decimal operator*(const Decimal& a, const Decimal& b) {
    return Decimal(a.mantissa_ * b.mantissa_, a.exponent_ + b.exponent_);
  }
  friend bool operator<(const Decimal& a, const Decimal& b) { return (a - b).IsNegative(); }
  /// times 10^by.
  Decimal Shifted(int by) const { return Decimal(mantissa_, exponent_ + by); }

  bool IsZero() const { return mantissa_.is_zero(); }
  bool IsNegative() const { return mantissa_ < 0; }
  bool IsPositive() const { return mantissa_ > 0; }
  Rational ToRational() const;
  /// The nearest double, ties to even; nullopt where it overflows, or underflows to zero.
  std::optional<double> Nearest() const;
  /// "-12e-3": exact.
  std::string Text() const;

 private:
  Integer mantissa_ = 0;
  int exponent_ = 0;
};

/// The double nearest to `value`; nullopt where it overflows, or underflows to zero.
std::optional<double> Nearest(const Rational& value);

}  // namespace lensd::optics
