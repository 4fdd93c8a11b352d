// Splits points at their commas; each part keeps its own unit.
#include "cli/offline/point.h"

#include <algorithm>
#include <vector>

#include "cli/text/quantity.h"

namespace lensd::cli {
namespace {

using optics::Rational;

}  // namespace

Result<std::array<Rational, 4>> ParsePoint(const std::string& text, std::string_view option) {
  const auto parts = SplitAtCommas(text);
  if (parts.size() != 3 && parts.size() != 4) {
    return Wrong(option, text, "write three lengths X,Y,Z such as 0mm,10mm,2m, or four plain numbers X,Y,Z,W");
  }
  std::array<Rational, 4> point{0, 0, 0, 1};
  const bool at_infinity = parts.size() == 3 && parts[2] == "inf";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (at_infinity && i == 2) continue;
    const auto number = parts.size() == 4 ? ParseNumber(parts[i], option) : ParseExactLength(parts[i], option);
    if (!number) return PassOn(number);
    point[i] = number->ToRational();
  }
  if (at_infinity) return std::array<Rational, 4>{0, 0, 1, 0};
  const bool nothing = std::ranges::all_of(point, [](const Rational& value) { return value.is_zero(); });
  if (nothing) return Wrong(option, text, "0,0,0,0 is no point");
  return point;
}

Result<std::array<Rational, 2>> ParsePlanePoint(const std::string& text, std::string_view option) {
  const auto parts = SplitAtCommas(text);
  if (parts.size() != 2) return Wrong(option, text, "write two lengths X,Y such as 1mm,-2mm");
  std::array<Rational, 2> point;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto number = ParseExactLength(parts[i], option);
    if (!number) return PassOn(number);
    point[i] = number->ToRational();
  }
  return point;
}

}  // namespace lensd::cli
