// The numbers of a request as the exact decimals they were written as.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>

#include "optics/planner.h"

namespace lensd::optics {

using Rational =
    boost::multiprecision::number<boost::multiprecision::rational_adaptor<boost::multiprecision::cpp_int_backend<>>,
                                  boost::multiprecision::et_off>;

/// The decimal of `number`, or the shortest decimal that reads back as its value.
Rational RationalOf(const Number& number);

}  // namespace lensd::optics
