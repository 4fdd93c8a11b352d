// Units of a plan's numbers are changed on their decimal digits, so that 0.1 mm arrives as 0.0001 m and not as the
// double nearest to a product.
#include "plan_numbers.h"

#include <cmath>

#include "optics/decimal.h"

namespace lensd::proto {

using optics::Decimal;

double Out(const optics::Number& number, int shift) {
  if (!std::isfinite(number.value)) return number.value;
  if (shift == 0 && number.decimal.empty()) return number.value;
  const auto decimal = number.decimal.empty() ? Decimal::Shortest(number.value) : Decimal::Read(number.decimal);
  return decimal ? decimal->Shifted(shift).Nearest().value_or(NAN) : NAN;
}

optics::Number In(double value, int shift) {
  if (shift == 0 || !std::isfinite(value)) return value;
  const Decimal decimal = Decimal::Shortest(value).Shifted(-shift);
  return {decimal.Nearest().value_or(NAN), decimal.Text()};
}

}  // namespace lensd::proto
