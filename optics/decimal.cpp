// Reading, adding and rounding decimals. Numbers of up to 18 digits, which nearly all are, never leave the stack.
#include "optics/decimal.h"

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

namespace lensd::optics {
namespace {

/// How long a number may be. What was read from people and then added and multiplied is longer than what they wrote.
struct Caps {
  std::size_t digits;
  int exponent;
};
constexpr Caps kWritten{200, 1000};
constexpr Caps kComputed{20'000, 20'000};
constexpr std::size_t kDigitsOfWord = 18;

std::string_view TakeDigits(std::string_view& text) {
  const auto count = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto digits = text.substr(0, count);
  text.remove_prefix(count);
  return digits;
}

/// Takes `e-5` and the like; nullopt where the exponent is absurd, 0 where there is none.
std::optional<int> TakeExponent(std::string_view& text, int largest) {
  if (text.empty() || (text[0] != 'e' && text[0] != 'E')) return 0;
  auto rest = text.substr(1);
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  auto digits = TakeDigits(rest);
  if (digits.empty()) return 0;
  text = rest;
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  if (digits.size() > 5) return std::nullopt;
  int value = 0;
  for (const char digit : digits) value = value * 10 + (digit - '0');
  if (value > largest) return std::nullopt;
  return negative ? -value : value;
}

Integer PowerOfTen(int exponent) {
  return boost::multiprecision::pow(Integer(10), static_cast<unsigned>(exponent));
}

/// Appends digits to a number, a machine word of them at a time.
void Append(std::string_view digits, Integer& number) {
  while (!digits.empty()) {
    const auto part = digits.substr(0, kDigitsOfWord);
    std::int64_t word = 0, scale = 1;
    for (const char digit : part) {
      word = word * 10 + (digit - '0');
      scale *= 10;
    }
    number = number * scale + word;
    digits.remove_prefix(part.size());
  }
}

std::optional<Decimal> Take(std::string_view& text, const Caps& caps) {
  auto rest = text;
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  const auto whole = TakeDigits(rest);
  std::string_view fraction;
  // A dot belongs to the number only with a digit after it: `1..2` is a range.
  if (rest.size() > 1 && rest[0] == '.' && rest[1] >= '0' && rest[1] <= '9') {
    rest.remove_prefix(1);
    fraction = TakeDigits(rest);
  }
  const auto count = whole.size() + fraction.size();
  if (count == 0 || count > caps.digits) return std::nullopt;
  const auto exponent = TakeExponent(rest, caps.exponent);
  if (!exponent) return std::nullopt;
  Integer mantissa = 0;
  Append(whole, mantissa);
  Append(fraction, mantissa);
  text = rest;
  if (negative) mantissa = -mantissa;
  return Decimal(std::move(mantissa), *exponent - static_cast<int>(fraction.size()));
}

}  // namespace

std::optional<Decimal> Decimal::TakeFrom(std::string_view& text) {
  return Take(text, kWritten);
}

std::optional<Decimal> Decimal::Read(std::string_view text) {
  auto number = Take(text, kComputed);
  return text.empty() ? number : std::nullopt;
}

Decimal Decimal::Shortest(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value, std::chars_format::scientific);
  return Read({text, static_cast<std::size_t>(end - text)}).value();
}

Decimal operator+(const Decimal& a, const Decimal& b) {
  if (a.IsZero()) return b;
  if (b.IsZero()) return a;
  if (a.exponent_ < b.exponent_) return b + a;
  return Decimal(a.mantissa_ * PowerOfTen(a.exponent_ - b.exponent_) + b.mantissa_, b.exponent_);
}

Rational Decimal::ToRational() const {
  if (exponent_ < 0) return Rational(mantissa_, PowerOfTen(-exponent_));
  return Rational(Integer(mantissa_ * PowerOfTen(exponent_)));
}

std::optional<double> Decimal::Nearest() const {
  if (IsZero()) return 0.0;
  constexpr auto kWord = std::numeric_limits<std::int64_t>::max();
  char small[48];
  std::string large;
  std::string_view text;
  if (mantissa_ <= kWord && mantissa_ >= -kWord) {
    constexpr std::size_t kDigits = 20;  // a sign and 19
    char* end = std::to_chars(small, small + kDigits, static_cast<std::int64_t>(mantissa_)).ptr;
    *end++ = 'e';
    end = std::to_chars(end, small + sizeof small, exponent_).ptr;
    text = {small, static_cast<std::size_t>(end - small)};
  } else {
    large = Text();
    text = large;
  }
  double value = 0.0;
  const auto error = std::from_chars(text.data(), text.data() + text.size(), value).ec;
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> Nearest(const Rational& value) {
  namespace mp = boost::multiprecision;
  using Real = mp::number<mp::cpp_bin_float<60>, mp::et_off>;
  const double nearest = (Real(mp::numerator(value)) / Real(mp::denominator(value))).convert_to<double>();
  if (!std::isfinite(nearest) || (nearest == 0.0 && !value.is_zero())) return std::nullopt;
  return nearest;
}

std::string Decimal::Text() const {
  return IsZero() ? "0" : mantissa_.str() + "e" + std::to_string(exponent_);
}

}  // namespace lensd::optics
