// Reads quantities with their units as exact decimals; every unit is known here and nowhere else.
#include "cli/text/quantity.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace lensd::cli {

std::unexpected<Error> Wrong(std::string_view option, std::string_view text, std::string_view why) {
  constexpr std::size_t kShown = 60;  // of a word that makes no sense, the rest adds nothing
  std::string word(text.substr(0, kShown));
  if (text.size() > kShown) {
    while (!word.empty() && (text[word.size()] & 0xC0) == 0x80) word.pop_back();  // no half of a letter
    word += "...";
  }
  return Fail(Code::InvalidArgument, std::string(option) + " '" + word + "': " + std::string(why));
}

namespace {

enum class Kind { Plain, Length, Vergence, Pixels, Time, Temperature, Percent };

/// A unit's spelling and how many of the base unit (m, 1/m, px, s, C, 1) it is: integer * 10^exponent.
struct Unit {
  std::string_view symbol;
  Kind kind;
  long long integer;
  int exponent;
};
constexpr Unit kUnits[] = {
    {"nm", Kind::Length, 1, -9},      {"um", Kind::Length, 1, -6}, {"\u00b5m", Kind::Length, 1, -6},
    {"\u03bcm", Kind::Length, 1, -6}, {"mm", Kind::Length, 1, -3}, {"cm", Kind::Length, 1, -2},
    {"m", Kind::Length, 1, 0},        {"km", Kind::Length, 1, 3},  {"in", Kind::Length, 254, -4},
    {"ft", Kind::Length, 3048, -4},   {"D", Kind::Vergence, 1, 0}, {"px", Kind::Pixels, 1, 0},
    {"ns", Kind::Time, 1, -9},        {"us", Kind::Time, 1, -6},   {"ms", Kind::Time, 1, -3},
    {"s", Kind::Time, 1, 0},          {"min", Kind::Time, 60, 0},  {"h", Kind::Time, 3600, 0},
    {"C", Kind::Temperature, 1, 0},   {"%", Kind::Percent, 1, -2}, {"", Kind::Plain, 1, 0},
};

struct Measure {
  Decimal value;  // in the base unit of its kind
  Kind kind = Kind::Plain;
};

const Unit* FindUnit(std::string_view symbol) {
  const auto* found = std::ranges::find(kUnits, symbol, &Unit::symbol);
  return found == std::end(kUnits) ? nullptr : found;
}

/// Number and unit, feet with inches included; nullopt where it is neither.
std::optional<Measure> TakeMeasure(std::string_view text) {
  const auto number = Decimal::TakeFrom(text);
  if (!number) return std::nullopt;
  if (text.size() > 2 && text.starts_with("ft")) {
    auto rest = text.substr(2);
    const auto inches = Decimal::TakeFrom(rest);
    const bool plain = text[2] != '-' && text[2] != '+' && !number->IsNegative();
    if (!inches || rest != "in" || !plain) return std::nullopt;
    return Measure{*number * Decimal(3048, -4) + *inches * Decimal(254, -4), Kind::Length};
  }
  const Unit* unit = FindUnit(text);
  if (unit == nullptr) return std::nullopt;
  return Measure{*number * Decimal(unit->integer, unit->exponent), unit->kind};
}

/// A measure of one of the kinds asked for; `fits` names examples for the message.
Result<Measure> Parse(std::string_view text, std::string_view option, std::initializer_list<Kind> kinds,
                      std::string_view fits) {
  const auto measure = TakeMeasure(text);
  if (!measure) return Wrong(option, text, "not a quantity; write " + std::string(fits));
  if (std::ranges::find(kinds, measure->kind) != kinds.end()) return *measure;
  if (measure->kind == Kind::Plain) return Wrong(option, text, "a bare number; give its unit: " + std::string(fits));
  return Wrong(option, text, "the wrong kind of quantity here; write " + std::string(fits));
}

constexpr std::string_view kLengths = "a length in nm um mm cm m km in ft, such as 850mm or 5ft7in";
constexpr std::string_view kDepths = "a distance in um mm cm m km in ft (0.8m, 33in), a vergence in D (2.5D), or inf";

/// Splits `A..B`; without dots both parts are the whole.
std::pair<std::string_view, std::string_view> SplitRange(std::string_view text) {
  const auto dots = text.find("..");
  if (dots == std::string_view::npos) return {text, text};
  return {text.substr(0, dots), text.substr(dots + 2)};
}

/// Passes `exact` on where a double can hold it.
Result<Decimal> Representable(Decimal exact, std::string_view text, std::string_view option) {
  if (!exact.Nearest()) return Wrong(option, text, "too large or too small to represent");
  return exact;
}

/// `A..B`, `A,B,C` or `A`, each read by `parse`.
Result<Openings> ParseOpenings(std::string_view text, std::string_view option,
                               Result<Decimal> (*parse)(std::string_view, std::string_view)) {
  Openings openings;
  std::vector<Decimal> values;
  const bool list = text.find(',') != std::string_view::npos;
  const auto [first, second] = SplitRange(text);
  const auto parts = list ? SplitAtCommas(text) : std::vector{first, second};
  for (const std::string_view part : parts) {
    auto value = parse(part, option);
    if (!value) return PassOn(value);
    values.push_back(*std::move(value));
  }
  std::ranges::sort(values, std::less<>());
  openings.range = {values.front(), values.back()};
  if (!list) return openings;
  const auto repeated = std::ranges::unique(values, [](const auto& a, const auto& b) { return !(a < b); });
  values.erase(repeated.begin(), repeated.end());
  openings.stops = std::move(values);
  return openings;
}

Result<Depth> ParseSubject(std::string_view text, std::string_view option) {
  auto depth = ParseDepth(text, option);
  if (depth && depth->value < 0.0) {
    return Wrong(option, text, "a negative vergence is past infinity, where there are no subjects; write 0D or inf");
  }
  return depth;
}

}  // namespace

std::vector<std::string_view> SplitAtCommas(std::string_view text) {
  std::vector<std::string_view> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const auto comma = std::min(text.find(',', start), text.size());
    parts.push_back(text.substr(start, comma - start));
    start = comma + 1;
  }
  return parts;
}

Result<Decimal> ParseExactLength(std::string_view text, std::string_view option) {
  const auto measure = Parse(text, option, {Kind::Length}, kLengths);
  if (!measure) return PassOn(measure);
  return Representable(measure->value, text, option);
}

Result<Metres> ParseLength(std::string_view text, std::string_view option) {
  const auto exact = ParseExactLength(text, option);
  if (!exact) return PassOn(exact);
  return Metres{exact->Nearest().value()};
}

Result<Decimal> ParsePositiveLength(std::string_view text, std::string_view option) {
  auto length = ParseExactLength(text, option);
  if (length && !length->IsPositive()) return Wrong(option, text, "must be greater than zero");
  return length;
}

Result<Span<Decimal>> ParseLengthRange(std::string_view text, std::string_view option) {
  const auto [first, second] = SplitRange(text);
  auto low = ParseExactLength(first, option);
  if (!low) return PassOn(low);
  auto high = ParseExactLength(second, option);
  if (!high) return PassOn(high);
  if (*high < *low) std::swap(*low, *high);
  return Span<Decimal>{*std::move(low), *std::move(high)};
}

Result<Depth> ParseDepth(std::string_view text, std::string_view option) {
  if (text == "inf") return Depth{};
  const auto measure = Parse(text, option, {Kind::Length, Kind::Vergence}, kDepths);
  if (!measure) return PassOn(measure);
  const auto exact = Representable(measure->value, text, option);
  if (!exact) return PassOn(exact);
  const double value = exact->Nearest().value();
  if (measure->kind == Kind::Vergence) return Depth{Depth::Form::Vergence, value, *exact};
  if (value <= 0.0) return Wrong(option, text, "a distance must be greater than zero");
  if (!std::isfinite(1.0 / value)) return Wrong(option, text, "too small to represent as a vergence");
  return Depth{Depth::Form::Distance, value, *exact};
}

Result<DepthRange> ParseDepthRange(std::string_view text, std::string_view option) {
  const auto [first, second] = SplitRange(text);
  auto near = ParseSubject(first, option);
  if (!near) return PassOn(near);
  auto far = ParseSubject(second, option);
  if (!far) return PassOn(far);
  const bool distances = near->IsDistance() && far->IsDistance();
  if (distances ? far->exact < near->exact : near->Vergence() < far->Vergence()) std::swap(*near, *far);
  return DepthRange{*near, *far};
}

Result<BlurSize> ParseBlur(std::string_view text, std::string_view option) {
  const auto measure = Parse(text, option, {Kind::Length, Kind::Pixels}, "a blur diameter such as 8um or 1.5px");
  if (!measure) return PassOn(measure);
  if (measure->value.IsZero() || measure->value.IsNegative()) {
    return Wrong(option, text, "a blur limit must be greater than zero");
  }
  auto value = Representable(measure->value, text, option);
  if (!value) return PassOn(value);
  return BlurSize{*std::move(value), measure->kind == Kind::Pixels};
}

Result<Decimal> BlurInMetres(const BlurSize& blur, std::string_view text, const std::optional<Decimal>& pixel,
                             std::string_view option) {
  if (!blur.in_pixels) return blur.value;
  if (!pixel) return Wrong(option, text, "a limit in px needs the size of a pixel: add --pixel, or write it in um");
  return Representable(blur.value * *pixel, text, option);
}

Result<Decimal> ParseBlurLimit(std::string_view text, const std::optional<Decimal>& pixel, std::string_view option) {
  const auto blur = ParseBlur(text, option);
  if (!blur) return PassOn(blur);
  return BlurInMetres(*blur, text, pixel, option);
}

Result<Decimal> ParseFNumber(std::string_view text, std::string_view option) {
  auto rest = text;
  if (rest.starts_with('f') || rest.starts_with('F')) rest.remove_prefix(1);
  if (rest.size() < text.size() && rest.starts_with('/')) rest.remove_prefix(1);
  const auto measure = TakeMeasure(rest);
  if (!measure || measure->kind != Kind::Plain) {
    return Wrong(option, text, "not an f-number; write a number without a unit, such as 2.8 or f/2.8");
  }
  if (!measure->value.IsPositive()) return Wrong(option, text, "an f-number must be greater than zero");
  return Representable(measure->value, text, option);
}

Result<Openings> ParseFNumbers(std::string_view text, std::string_view option) {
  return ParseOpenings(text, option, &ParseFNumber);
}

Result<Openings> ParseDiameters(std::string_view text, std::string_view option) {
  return ParseOpenings(text, option, &ParsePositiveLength);
}

Result<Decimal> ParsePercent(std::string_view text, std::string_view option) {
  const auto measure = Parse(text, option, {Kind::Percent}, "a percentage such as 2%");
  if (!measure) return PassOn(measure);
  if (measure->value.IsNegative()) return Wrong(option, text, "must not be negative");
  return Representable(measure->value, text, option);
}

Result<Duration> ParseTime(std::string_view text, std::string_view option) {
  const auto measure = Parse(text, option, {Kind::Time}, "a time in ns us ms s min h, such as 500ms");
  if (!measure) return PassOn(measure);
  const auto seconds = measure->value.Nearest();
  constexpr double kLongestS = 9e9;
  if (!seconds || *seconds < 0.5e-9 || *seconds > kLongestS) return Wrong(option, text, "must be between 1ns and 9e9s");
  return Duration{std::llround(*seconds * 1e9)};
}

Result<Decimal> ParseNumber(std::string_view text, std::string_view option) {
  const auto measure = Parse(text, option, {Kind::Plain}, "a plain number");
  if (!measure) return PassOn(measure);
  return Representable(measure->value, text, option);
}

}  // namespace lensd::cli
