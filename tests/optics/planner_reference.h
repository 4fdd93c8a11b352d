// An independent planner in exact rational arithmetic: half-planes straight from the blur formula, every side of every
// open interval tried, the extension eliminated pair by pair (Fourier and Motzkin). Slow, and shares nothing with the
// planner it checks but the request type.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "optics/planner.h"

namespace lensd::optics::reference {

using Integer = boost::multiprecision::cpp_int;
using Rational = boost::multiprecision::cpp_rational;

/// The decimal a number stands for.
Rational Exact(const Number& number);
/// The decimal text of a rational whose denominator has only the factors 2 and 5.
std::string DecimalText(const Rational& rational);
/// A Number that stands for exactly this rational (denominator of 2 and 5 only).
Number ExactNumber(const Rational& rational);

/// Rational from a double, exactly.
Rational FromDouble(double value);

/// What to ask for: all of a request, or a part of its names, at another ratio, at one f-number.
struct Question {
  std::optional<std::set<std::string>> names;  ///< only these bind; nothing: all
  Rational ratio = 1;                          ///< sharp limits times this, blurred ones divided by it
  std::optional<Rational> n;                   ///< only this f-number
};

struct NRange {
  Rational smallest;
  Rational largest;
};

/// The f-numbers that some extension serves (smallest and largest over all sides and stops); nothing when there are
/// none. Ends that are not bounded are -1.
std::optional<NRange> Feasible(const PlanRequest& request, const Question& question = {});

/// How far a limit is broken at (n, e), relative to the limit, worst over depths and tolerances; at most 0 when it
/// holds. An interval whose side is open counts from its better side.
Rational Excess(const PlanRequest& request, const BlurLimit& limit, double n, double e);

}  // namespace lensd::optics::reference
