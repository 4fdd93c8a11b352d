// The numbers of a request as the exact decimals they were written as.
#pragma once

#include "optics/decimal.h"
#include "optics/plan_request.h"

namespace lensd::optics {

/// The decimal of `number`, or the shortest decimal that reads back as its value.
inline Decimal DecimalOf(const Number& number) {
  return number.decimal.empty() ? Decimal::Shortest(number.value) : Decimal::Read(number.decimal).value();
}

inline Rational RationalOf(const Number& number) {
  return DecimalOf(number).ToRational();
}

}  // namespace lensd::optics
