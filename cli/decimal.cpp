#include "cli/decimal.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

namespace lensd::cli {
namespace {

constexpr std::size_t kMostDigits = 200;
constexpr int kLargestExponent = 1000;

std::string_view TakeDigits(std::string_view& text) {
  const auto count = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto digits = text.substr(0, count);
  text.remove_prefix(count);
  return digits;
}

/// Takes `e-5` and the like; nullopt where the exponent is absurd, 0 where there is none.
std::optional<int> TakeExponent(std::string_view& text) {
  if (text.empty() || (text[0] != 'e' && text[0] != 'E')) return 0;
  auto rest = text.substr(1);
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  auto digits = TakeDigits(rest);
  if (digits.empty()) return 0;
  text = rest;
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  if (digits.size() > 4) return std::nullopt;
  int value = 0;
  for (const char digit : digits) value = value * 10 + (digit - '0');
  if (value > kLargestExponent) return std::nullopt;
  return negative ? -value : value;
}

/// Compares magnitudes of digit strings of equal length, sums or subtracts them: schoolbook, most significant first.
std::string Sum(const std::string& a, const std::string& b) {
  std::string sum(a.size() + 1, '0');
  int carry = 0;
  for (std::size_t i = a.size(); i-- > 0;) {
    const int digit = (a[i] - '0') + (b[i] - '0') + carry;
    sum[i + 1] = static_cast<char>('0' + digit % 10);
    carry = digit / 10;
  }
  sum[0] = static_cast<char>('0' + carry);
  return sum;
}

/// a - b for a >= b of equal length.
std::string Difference(const std::string& a, const std::string& b) {
  std::string difference(a.size(), '0');
  int borrow = 0;
  for (std::size_t i = a.size(); i-- > 0;) {
    const int digit = a[i] - b[i] - borrow;
    borrow = digit < 0 ? 1 : 0;
    difference[i] = static_cast<char>('0' + digit + 10 * borrow);
  }
  return difference;
}

}  // namespace

Decimal::Decimal(long long integer, int exponent)
    : negative_(integer < 0), digits_(std::to_string(integer < 0 ? -integer : integer)), exponent_(exponent) {
  Normalise();
}

void Decimal::Normalise() {
  const auto first = std::min(digits_.find_first_not_of('0'), digits_.size());
  digits_.erase(0, first);
  while (!digits_.empty() && digits_.back() == '0') {
    digits_.pop_back();
    ++exponent_;
  }
  if (digits_.empty()) {
    negative_ = false;
    exponent_ = 0;
  }
}

std::optional<Decimal> Decimal::TakeFrom(std::string_view& text) {
  auto rest = text;
  Decimal number;
  number.negative_ = rest.starts_with('-');
  if (number.negative_ || rest.starts_with('+')) rest.remove_prefix(1);
  number.digits_ = TakeDigits(rest);
  // A dot belongs to the number only with a digit after it: `1..2` is a range.
  if (rest.size() > 1 && rest[0] == '.' && rest[1] >= '0' && rest[1] <= '9') {
    rest.remove_prefix(1);
    const auto fraction = TakeDigits(rest);
    number.digits_ += fraction;
    number.exponent_ = -static_cast<int>(std::min(fraction.size(), kMostDigits));
  }
  if (number.digits_.empty() || number.digits_.size() > kMostDigits) return std::nullopt;
  const auto exponent = TakeExponent(rest);
  if (!exponent) return std::nullopt;
  number.exponent_ += *exponent;
  number.Normalise();
  text = rest;
  return number;
}

Decimal operator+(const Decimal& a, const Decimal& b) {
  if (a.IsZero()) return b;
  if (b.IsZero()) return a;
  Decimal sum;
  sum.exponent_ = std::min(a.exponent_, b.exponent_);
  std::string left = a.digits_ + std::string(a.exponent_ - sum.exponent_, '0');
  std::string right = b.digits_ + std::string(b.exponent_ - sum.exponent_, '0');
  const auto width = std::max(left.size(), right.size());
  left.insert(0, width - left.size(), '0');
  right.insert(0, width - right.size(), '0');
  const bool left_larger = left >= right;
  sum.negative_ = left_larger ? a.negative_ : b.negative_;
  if (a.negative_ == b.negative_) {
    sum.digits_ = Sum(left, right);
  } else {
    sum.digits_ = left_larger ? Difference(left, right) : Difference(right, left);
  }
  sum.Normalise();
  return sum;
}

Decimal operator*(const Decimal& a, const Decimal& b) {
  Decimal product;
  product.negative_ = a.negative_ != b.negative_;
  product.exponent_ = a.exponent_ + b.exponent_;
  std::vector<int> places(a.digits_.size() + b.digits_.size(), 0);  // least significant first
  for (std::size_t i = 0; i < a.digits_.size(); ++i) {
    for (std::size_t j = 0; j < b.digits_.size(); ++j) {
      places[i + j] += (a.digits_[a.digits_.size() - 1 - i] - '0') * (b.digits_[b.digits_.size() - 1 - j] - '0');
    }
  }
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    places[i + 1] += places[i] / 10;
    places[i] %= 10;
  }
  for (auto place = places.rbegin(); place != places.rend(); ++place) {
    product.digits_ += static_cast<char>('0' + *place);
  }
  product.Normalise();
  return product;
}

Decimal Decimal::Shortest(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value, std::chars_format::scientific);
  std::string_view rest(text, end - text);
  return TakeFrom(rest).value();
}

std::string Decimal::Text() const {
  if (IsZero()) return "0";
  return (negative_ ? "-" : "") + digits_ + "e" + std::to_string(exponent_);
}

std::optional<double> Decimal::Nearest() const {
  const std::string text = Text();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace lensd::cli
