#include "rational.h"

#include <charconv>
#include <cstdlib>
#include <string_view>

namespace lensd::optics {
namespace {

/// "-12.5e-6": digits without the point, times a power of ten.
Rational Read(std::string_view text) {
  const std::size_t end = std::min(text.find_first_of("eE"), text.size());
  int exponent = 0;
  if (end < text.size()) {
    const std::string_view tail = text.substr(end + (text.substr(end + 1).starts_with('+') ? 2 : 1));
    std::from_chars(tail.data(), tail.data() + tail.size(), exponent);
  }
  boost::multiprecision::cpp_int digits = 0;
  bool fraction = false;
  for (const char c : text.substr(0, end)) {
    if (c == '.') fraction = true;
    if (c < '0' || c > '9') continue;
    digits = digits * 10 + (c - '0');
    if (fraction) --exponent;
  }
  if (text.starts_with('-')) digits = -digits;
  const boost::multiprecision::cpp_int power =
      boost::multiprecision::pow(boost::multiprecision::cpp_int(10), static_cast<unsigned>(std::abs(exponent)));
  return exponent < 0 ? Rational(digits) / Rational(power) : Rational(digits) * Rational(power);
}

}  // namespace

Rational RationalOf(const Number& number) {
  if (!number.decimal.empty()) return Read(number.decimal);
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, number.value);
  return Read(std::string_view(text, static_cast<std::size_t>(end.ptr - text)));
}

}  // namespace lensd::optics
