// What people write must become the double nearest to the exact decimal value: checked against rational arithmetic.
#include "cli/text/quantity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "cli/text/text.h"

namespace lensd::cli {
namespace {

using boost::multiprecision::cpp_int;
using boost::multiprecision::cpp_rational;
using testing::HasSubstr;

/// The exact value of a finite double.
cpp_rational Exact(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const cpp_rational scaled(static_cast<long long>(std::ldexp(mantissa, 53)));
  const int power = exponent - 53;
  const cpp_rational factor(cpp_int(1) << std::abs(power));
  if (power < 0) return scaled / factor;
  return scaled * factor;
}

/// Whether `value` is a double nearest to `exact`: neither neighbour is nearer.
bool IsNearest(double value, const cpp_rational& exact) {
  const auto error = [&exact](double candidate) -> cpp_rational { return abs(Exact(candidate) - exact); };
  const double below = std::nextafter(value, -std::numeric_limits<double>::infinity());
  const double above = std::nextafter(value, std::numeric_limits<double>::infinity());
  return error(value) <= error(below) && error(value) <= error(above);
}

cpp_rational PowerOfTen(int exponent) {
  cpp_int power = 1;
  for (int i = 0; i < std::abs(exponent); ++i) power *= 10;
  return exponent < 0 ? cpp_rational(cpp_int(1), power) : cpp_rational(power);
}

/// A number as text, and its value.
struct Written {
  std::string text;
  cpp_rational value;
};
Written AnyNumber(int most_digits) {
  const int before = *rc::gen::inRange(0, most_digits);
  const int after = *rc::gen::inRange(before == 0 ? 1 : 0, most_digits);
  const auto digits = *rc::gen::container<std::string>(before + after, rc::gen::inRange('0', char('9' + 1)));
  const int exponent = *rc::gen::inRange(-30, 30);
  const bool with_exponent = *rc::gen::arbitrary<bool>();
  std::string text = digits.substr(0, before);
  if (after > 0) text += "." + digits.substr(before);
  if (with_exponent) text += (*rc::gen::arbitrary<bool>() ? "e" : "E") + std::to_string(exponent);
  const std::string significant = digits.substr(std::min(digits.find_first_not_of('0'), digits.size() - 1));
  return {text, cpp_rational(cpp_int(significant)) * PowerOfTen((with_exponent ? exponent : 0) - after)};
}

TEST(Quantity, EveryLengthIsTheNearestDouble) {
  struct {
    const char* unit;
    cpp_rational metres;
  } const units[] = {{"nm", PowerOfTen(-9)}, {"um", PowerOfTen(-6)},           {"\u00b5m", PowerOfTen(-6)},
                     {"mm", PowerOfTen(-3)}, {"cm", PowerOfTen(-2)},           {"m", 1},
                     {"km", PowerOfTen(3)},  {"in", cpp_rational(254, 10000)}, {"ft", cpp_rational(3048, 10000)}};
  EXPECT_TRUE(rc::check([&] {
    const auto& unit = units[*rc::gen::inRange<std::size_t>(0, std::size(units))];
    const Written number = AnyNumber(40);
    const bool negative = *rc::gen::arbitrary<bool>();
    const auto parsed = ParseLength((negative ? "-" : "") + number.text + unit.unit, "--x");
    RC_ASSERT(parsed.has_value());
    RC_ASSERT(IsNearest(parsed->value, (negative ? -1 : 1) * number.value * unit.metres));
  }));
}

TEST(Quantity, FeetWithInchesAndPixelLimitsAreExact) {
  EXPECT_TRUE(rc::check([] {
    const Written feet = AnyNumber(12), inches = AnyNumber(12);
    const auto length = ParseLength(feet.text + "ft" + inches.text + "in", "--x");
    RC_ASSERT(length.has_value());
    RC_ASSERT(
        IsNearest(length->value, feet.value * cpp_rational(3048, 10000) + inches.value * cpp_rational(254, 10000)));
  }));
  EXPECT_TRUE(rc::check([] {
    const Written limit = AnyNumber(20), pixel = AnyNumber(20);
    RC_PRE(limit.value != 0);
    const auto pitch = ParseExactLength(pixel.text + "um", "--pixel");
    RC_ASSERT(pitch.has_value());
    const auto metres = ParseBlurLimit(limit.text + "px", *pitch, "--sharp");
    RC_ASSERT(metres.has_value());
    RC_ASSERT(IsNearest(metres->Nearest().value(), limit.value * pixel.value * PowerOfTen(-6)));
  }));
}

TEST(Quantity, SumsOfAnySignsAreExact) {
  EXPECT_TRUE(rc::check([] {
    const Written a = AnyNumber(25), b = AnyNumber(25);
    const auto first = ParseExactLength("-" + a.text + "m", "--x"), second = ParseExactLength(b.text + "m", "--x");
    RC_ASSERT(first.has_value() && second.has_value());
    RC_ASSERT(IsNearest((*first + *second).Nearest().value(), b.value - a.value));
  }));
}

TEST(Quantity, KnownValues) {
  EXPECT_EQ(ParseLength("33in", "--x")->value, 0.8382);
  EXPECT_EQ(ParseLength("5ft7in", "--x")->value, 1.7018);
  EXPECT_EQ(ParseLength("850mm", "--x")->value, 0.85);
  EXPECT_EQ(ParseLength("3.45um", "--x")->value, 3.45e-6);
  EXPECT_EQ(ParseLength("-1.5mm", "--x")->value, -0.0015);
  EXPECT_EQ(ParsePercent("2%", "--x")->Nearest(), 0.02);
  EXPECT_EQ(ParseTime("1.5ms", "--x")->count(), 1'500'000);
  EXPECT_EQ(*ParseTime("10min", "--x"), std::chrono::minutes(10));
  EXPECT_EQ(*ParseTime("1.5h", "--x"), std::chrono::minutes(90));
  EXPECT_EQ(ParseFNumber("f/2.8", "--x")->Nearest(), 2.8);
  EXPECT_EQ(ParseNumber("1.2", "--x")->Nearest(), 1.2);
}

void ExpectDepth(const char* text, Depth::Form form, double value) {
  const auto depth = ParseDepth(text, "--focus");
  ASSERT_TRUE(depth) << depth.error().message;
  EXPECT_EQ(depth->form, form) << text;
  EXPECT_EQ(depth->value, value) << text;
  EXPECT_EQ(depth->exact.Nearest(), value) << text;
}

TEST(Quantity, DepthsKeepTheirForm) {
  ExpectDepth("0.8m", Depth::Form::Distance, 0.8);
  ExpectDepth("1.2e-5D", Depth::Form::Vergence, 1.2e-5);
  ExpectDepth("-0.1D", Depth::Form::Vergence, -0.1);
  EXPECT_TRUE(ParseDepth("inf", "--focus")->IsInfinite());
  EXPECT_TRUE(ParseDepth("0D", "--focus")->IsInfinite());
}

TEST(Quantity, RangesComeInEitherOrder) {
  for (const char* text : {"2m..inf", "inf..2m"}) {
    const auto range = ParseDepthRange(text, "--sharp");
    ASSERT_TRUE(range) << range.error().message;
    EXPECT_EQ(range->near.value, 2.0);
    EXPECT_TRUE(range->near.IsDistance());
    EXPECT_TRUE(range->far.IsInfinite());
  }
  EXPECT_EQ(ParseDepthRange("0.4D..2m", "--sharp")->near.value, 2.0);
  EXPECT_EQ(ParseDepthRange("2.5D..4D", "--sharp")->near.value, 4.0);
  EXPECT_EQ(ParseLengthRange("8mm..-0.5mm", "--extension")->low.Nearest(), -0.0005);
  const auto stops = ParseFNumbers("2.8,1.4,f/2,2.0", "--f-number");
  ASSERT_TRUE(stops);
  std::vector<double> values;
  for (const Decimal& stop : stops->stops) values.push_back(stop.Nearest().value());
  EXPECT_THAT(values, testing::ElementsAre(1.4, 2.0, 2.8));
  EXPECT_EQ(ParseFNumbers("22..1.4", "--f-number")->range.low.Nearest(), 1.4);
  EXPECT_EQ(ParseFNumbers("f/1.4..f/22", "--f-number")->range.high.Nearest(), 22.0);
}

/// 10^a with a drawn evenly from [low, high].
double AnySize(double low, double high) {
  return std::pow(10.0, low + (high - low) * *rc::gen::inRange(0, 1'000'000) / 1e6);
}

// Four digits and six decimals are shown.
bool SameAsShown(double read, double shown) {
  return std::abs(read - shown) <= 6e-4 * std::abs(shown) + 0.6e-6;
}

// Of a distance too, the coarsest in feet: a fifth of a millimetre, 4331 D, is 0.000758 ft.
bool SameDepthAsShown(double read, double shown) {
  constexpr double kFootMetres = 0.3048;
  return SameAsShown(read, shown) || std::abs(1.0 / read - 1.0 / shown) <= 0.6e-6 * kFootMetres;
}

TEST(Quantity, EveryDepthThatIsPrintedIsReadBack) {
  EXPECT_TRUE(rc::check([] {
    ShowDistancesIn(static_cast<DistanceUnit>(*rc::gen::inRange<std::size_t>(0, kDistanceUnits.size())));
    const int sign = *rc::gen::element(1, 1, 1, 0, -1);
    const double vergence = sign * AnySize(-9, 4);
    const std::string text = DepthText({vergence});
    const auto whole = ParseDepth(text, "--focus");
    RC_ASSERT(whole.has_value());
    RC_ASSERT(SameDepthAsShown(whole->Vergence().value, vergence));
    if (sign <= 0) return;
    const std::string first = text.substr(0, text.find(" ("));
    const auto alone = ParseDepth(first, "--focus");
    RC_ASSERT(alone.has_value());
    RC_ASSERT(SameDepthAsShown(alone->Vergence().value, vergence));
    const auto range = ParseDepthRange(first + "..infinity", "--sharp");
    RC_ASSERT(range.has_value() && range->far.IsInfinite());
  }));
  ShowDistancesIn(DistanceUnit::Metres);
}

TEST(Quantity, EveryLengthTimeAndFNumberThatIsPrintedIsReadBack) {
  EXPECT_TRUE(rc::check([] {
    const double metres = AnySize(-6, 6);
    const auto length = ParseLength(LengthText({metres}), "--focal-length");
    RC_ASSERT(length.has_value());
    RC_ASSERT(std::abs(length->value - metres) <= 6e-5 * metres + 0.6e-12);
    const double n = AnySize(-1, 2);
    const auto f_number = ParseFNumber("f/" + Short(n), "--f-number");
    RC_ASSERT(f_number && SameAsShown(*f_number->Nearest(), n));
    const double ms = AnySize(-2, 5);
    const auto time = ParseTime(ms < 1e3 ? Short(ms) + " ms" : Short(1e-3 * ms) + " s", "--timeout");
    RC_ASSERT(time && SameAsShown(1e-6 * static_cast<double>(time->count()), ms));
  }));
}

TEST(Quantity, WhatPeopleTypeIsRead) {
  ExpectDepth("1.2 m", Depth::Form::Distance, 1.2);
  ExpectDepth(" 1.2\u00a0m ", Depth::Form::Distance, 1.2);
  ExpectDepth("3'", Depth::Form::Distance, 0.9144);
  ExpectDepth("5'7\"", Depth::Form::Distance, 1.7018);
  ExpectDepth("5 ft 7 in", Depth::Form::Distance, 1.7018);
  ExpectDepth("5\u20327\u2033", Depth::Form::Distance, 1.7018);
  ExpectDepth("past infinity (-0.1 D)", Depth::Form::Vergence, -0.1);
  for (const char* text : {"inf", "Inf", "INF", "infinity", "Infinity", "\u221e", "infinity (0 D)"}) {
    ASSERT_TRUE(ParseDepth(text, "--focus")) << text;
    EXPECT_TRUE(ParseDepth(text, "--focus")->IsInfinite()) << text;
  }
  EXPECT_EQ(ParseFNumber("1:2.8", "--x")->Nearest(), 2.8);
  EXPECT_EQ(ParseFNumber("f 2.8", "--x")->Nearest(), 2.8);
  EXPECT_EQ(ParseTime("1/250s", "--x")->count(), 4'000'000);
  EXPECT_EQ(ParseTime("1/4 ms", "--x")->count(), 250'000);
  for (const char* text : {"1/0s", "1/s", "/250s", "1/250", "-1/250s", "1/250m"}) EXPECT_FALSE(ParseTime(text, "--x"));
}

template <class T>
std::string Complaint(const Result<T>& result) {
  return result ? "accepted" : result.error().message;
}

TEST(Quantity, SaysWhatWouldFit) {
  EXPECT_THAT(Complaint(ParseLength("50", "--focal-length")), HasSubstr("--focal-length '50': a bare number"));
  EXPECT_THAT(Complaint(ParseLength("50", "--focal-length")), HasSubstr("mm"));
  EXPECT_THAT(Complaint(ParseDepth("0.8", "--focus")), HasSubstr("2.5D"));
  EXPECT_THAT(Complaint(ParseLength("3ms", "--extension")), HasSubstr("wrong kind"));
  EXPECT_THAT(Complaint(ParseBlurLimit("1px", std::nullopt, "--sharp")), HasSubstr("--pixel"));
  EXPECT_THAT(Complaint(ParsePercent("0.02", "--f-number-tolerance")), HasSubstr("2%"));
}

/// What stands behind the last "write " of a complaint.
template <class T>
std::string Instead(const Result<T>& result) {
  const std::string said = Complaint(result);
  const std::size_t at = said.rfind("write ");
  return at == std::string::npos ? said : said.substr(at + 6);
}

TEST(Quantity, WhatIsWrittenOtherwiseIsSaidAsItIsRead) {
  EXPECT_TRUE(rc::check([] {
    const std::string first = std::to_string(*rc::gen::inRange(1, 1000)),
                      last = std::to_string(*rc::gen::inRange(0, 1000));
    const std::string unit = *rc::gen::element<std::string>("mm", "cm", "m", "km", "in", "ft", "D");
    const std::string right = first + "." + last + unit;
    std::string other_case = unit;
    for (char& c : other_case) c = static_cast<char>(c ^ 0x20);
    RC_ASSERT(Instead(ParseDepth(first + "," + last + unit, "--focus")) == right);
    RC_ASSERT(Instead(ParseDepth(first + "," + last + " " + other_case, "--focus")) == right);
    RC_ASSERT(Instead(ParseDepth(first + "." + last + other_case, "--focus")) == right);
    const std::string between = *rc::gen::element<std::string>("-", " - ", " to ", "...", "\u2013");
    const std::string end = *rc::gen::element<std::string>("7m", "inf", "infinity");
    RC_ASSERT(Instead(ParseDepthRange(right + between + end, "--sharp")) == right + ".." + end);
    RC_ASSERT(ParseDepthRange(right + ".." + end, "--sharp").has_value());
  }));
  EXPECT_EQ(Instead(ParseDepthRange("2-3m", "--sharp")), "2m..3m");
  EXPECT_EQ(Instead(ParseFNumber("2,8", "--f-number")), "2.8");
  EXPECT_EQ(Instead(ParseFNumbers("2,8", "--f-number")), "2.8 for one f-number, or f/2,f/8 for a list of two");
  for (const char* list : {"f/2,f/8", "2,16", "1.4,2,2.8"}) EXPECT_TRUE(ParseFNumbers(list, "--f-number")) << list;
  EXPECT_EQ(Instead(ParseBlur("0,03mm", "--blur-limit")), "0.03mm");
  EXPECT_EQ(Instead(ParseDiameters("1,5mm", "--aperture-diameter")), "1.5mm");
  EXPECT_THAT(Complaint(ParseDepth("2m-3m", "--focus")), HasSubstr("not a range"));
}

TEST(Quantity, RefusesWhatIsNoQuantity) {
  for (const char* text :
       {"",        "m",        "nan",     "nanm",    "infm", "-inf",   "1..2", "0x10m", "1 m m", "1e",    "--3m",
        "1e9999m", "1e-2000m", "3ft-2in", "-3ft2in", "5ft7", "5ft7cm", ".m",   "5.m",   "1,5m",  "1e400m"}) {
    EXPECT_FALSE(ParseLength(text, "--x")) << text;
  }
  for (const char* text : {"0m", "-1m", "1..2m", "2m..", "..", "2m..3", "-1D", "2m..-1D", "inf..x"}) {
    EXPECT_FALSE(ParseDepthRange(text, "--x")) << text;
  }
  for (const char* text : {"0", "-2", "f/", "2.8m", "inf", "nan", "1.4,", ",", "1.4..x", "f/0"}) {
    EXPECT_FALSE(ParseFNumbers(text, "--x")) << text;
  }
  for (const char* text : {"0um", "-1um", "nan", "0px"})
    EXPECT_FALSE(ParseBlurLimit(text, Decimal(1, -6), "--x")) << text;
  EXPECT_FALSE(ParseLength(std::string(500, '1') + "m", "--x"));
}

}  // namespace
}  // namespace lensd::cli
