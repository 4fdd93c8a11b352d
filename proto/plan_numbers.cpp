#include "plan_numbers.h"

#include <charconv>
#include <cmath>
#include <string_view>

namespace lensd::proto {
namespace {

/// A decimal with an exponent, "-1.25e-05", on the stack.
class Decimal {
 public:
  explicit Decimal(double value) {
    end_ = std::to_chars(text_, text_ + sizeof text_, value, std::chars_format::scientific).ptr;
  }
  /// Moves the exponent.
  void Shift(int by) {
    char* const mark = text_ + std::string_view(text_, end_).find('e');
    const char* const digits = mark + (mark[1] == '+' ? 2 : 1);
    int exponent = 0;
    std::from_chars(digits, end_, exponent);
    end_ = std::to_chars(mark + 1, text_ + sizeof text_, exponent + by).ptr;
  }
  std::string_view text() const { return {text_, end_}; }

 private:
  char text_[40];
  char* end_;
};

double Nearest(std::string_view text) {
  double value = NAN;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// `text` times 10^shift.
std::string Shifted(const std::string& text, int shift) {
  const auto mark = text.find_first_of("eE");
  int exponent = 0;
  if (mark != std::string::npos) {
    const char* digits = text.data() + mark + 1;
    std::from_chars(digits + (*digits == '+' ? 1 : 0), text.data() + text.size(), exponent);
  }
  return text.substr(0, mark) + "e" + std::to_string(exponent + shift);
}

}  // namespace

double Out(const optics::Number& number, int shift) {
  if (!std::isfinite(number.value)) return number.value;
  if (!number.decimal.empty()) return Nearest(Shifted(number.decimal, shift));
  if (shift == 0) return number.value;
  Decimal decimal(number.value);
  decimal.Shift(shift);
  return Nearest(decimal.text());
}

optics::Number In(double value, int shift) {
  if (shift == 0) return value;
  Decimal decimal(value);
  decimal.Shift(-shift);
  return {Nearest(decimal.text()), std::string(decimal.text())};
}

}  // namespace lensd::proto
