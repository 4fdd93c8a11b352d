// Reads quantities with their units as exact decimals; every unit is known here and nowhere else.
#include "cli/text/quantity.h"

#include <algorithm>
#include <array>
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
    {"nm", Kind::Length, 1, -9},      {"um", Kind::Length, 1, -6},   {"\u00b5m", Kind::Length, 1, -6},
    {"\u03bcm", Kind::Length, 1, -6}, {"mm", Kind::Length, 1, -3},   {"cm", Kind::Length, 1, -2},
    {"m", Kind::Length, 1, 0},        {"km", Kind::Length, 1, 3},    {"in", Kind::Length, 254, -4},
    {"ft", Kind::Length, 3048, -4},   {"D", Kind::Vergence, 1, 0},   {"px", Kind::Pixels, 1, 0},
    {"ns", Kind::Time, 1, -9},        {"us", Kind::Time, 1, -6},     {"ms", Kind::Time, 1, -3},
    {"s", Kind::Time, 1, 0},          {"min", Kind::Time, 60, 0},    {"h", Kind::Time, 3600, 0},
    {"C", Kind::Temperature, 1, 0},   {"%", Kind::Percent, 1, -2},   {"", Kind::Plain, 1, 0},
    {"'", Kind::Length, 3048, -4},    {"\"", Kind::Length, 254, -4},
};

struct Measure {
  Decimal value;  // in the base unit of its kind
  Kind kind = Kind::Plain;
};

const Unit* FindUnit(std::string_view symbol) {
  const auto* found = std::ranges::find(kUnits, symbol, &Unit::symbol);
  return found == std::end(kUnits) ? nullptr : found;
}

void SkipSpaces(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
}

/// `text` without spaces at its ends, and with the ASCII character for each typographic one that programs put into
/// text.
std::string InAscii(std::string_view text) {
  static constexpr std::pair<std::string_view, std::string_view> kAscii[] = {
      {"\u00a0", " "}, {"\u2009", " "}, {"\u202f", " "},  {"\u2212", "-"},
      {"\u2019", "'"}, {"\u2032", "'"}, {"\u2033", "\""}, {"\t", " "}};
  std::string plain(text);
  for (const auto& [typographic, ascii] : kAscii) {
    for (std::size_t at = 0; (at = plain.find(typographic, at)) != plain.npos; at += ascii.size()) {
      plain.replace(at, typographic.size(), ascii);
    }
  }
  plain.erase(0, plain.find_first_not_of(' '));
  plain.erase(plain.find_last_not_of(' ') + 1);
  return plain;
}

/// Number and unit, also with a space between them as lensctl prints them; feet with inches included. Nullopt where it
/// is neither.
std::optional<Measure> TakeMeasure(std::string_view written) {
  const std::string ascii = InAscii(written);
  std::string_view text = ascii;
  const auto number = Decimal::TakeFrom(text);
  if (!number) return std::nullopt;
  SkipSpaces(text);
  const std::size_t feet = text.starts_with("ft") ? 2 : text.starts_with('\'') ? 1 : 0;
  if (feet > 0 && text.size() > feet) {
    auto rest = text.substr(feet);
    SkipSpaces(rest);
    const bool plain = !rest.starts_with('-') && !rest.starts_with('+') && !number->IsNegative();
    const auto inches = Decimal::TakeFrom(rest);
    SkipSpaces(rest);
    if (!inches || (rest != "in" && rest != "\"") || !plain) return std::nullopt;
    return Measure{*number * Decimal(3048, -4) + *inches * Decimal(254, -4), Kind::Length};
  }
  const Unit* unit = FindUnit(text);
  if (unit == nullptr) return std::nullopt;
  return Measure{*number * Decimal(unit->integer, unit->exponent), unit->kind};
}

std::string InLowerCase(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return lower;
}

/// `inf`, `infinity` and the sign for it, in any case.
bool IsInfinity(std::string_view text) {
  const std::string lower = InLowerCase(InAscii(text));
  return lower == "inf" || lower == "infinity" || lower == "\u221e";
}

/// The two ends of what is written as a range, but not with two dots: `2m-3m`, `2-3m`, `2m to 3m`, `2m...3m`.
std::optional<std::pair<std::string, std::string>> EndsOfOtherRange(std::string_view text) {
  for (const std::string_view between : {"...", "\u2026", " to ", "\u2013", "\u2014", "-"}) {
    const std::size_t at = text.find(between, 1);
    if (at == text.npos || at + between.size() >= text.size()) continue;
    const std::string first = InAscii(text.substr(0, at)), second = InAscii(text.substr(at + between.size()));
    const auto near = TakeMeasure(first), far = TakeMeasure(second);
    if ((!near && !IsInfinity(first)) || (!far && !IsInfinity(second))) continue;
    if (!near || !far || near->kind != Kind::Plain || far->kind == Kind::Plain) return std::pair(first, second);
    std::string_view unit = second;
    Decimal::TakeFrom(unit);
    return std::pair(first + std::string(unit), second);
  }
  return std::nullopt;
}

/// What is wrong with a number and its unit, and how it is written right. Nullopt where that cannot be seen.
std::optional<std::string> AdviceOn(std::string_view written) {
  std::string text = InAscii(written);
  std::string wrong;
  if (std::ranges::count(text, ',') == 1 && text.find('.') == text.npos) {
    text[text.find(',')] = '.';
    wrong = "decimals stand after a point, not after a comma";
  }
  std::string_view symbol = text;
  if (Decimal::TakeFrom(symbol) && !TakeMeasure(text)) {
    const std::string number = text.substr(0, text.size() - symbol.size());
    SkipSpaces(symbol);
    const std::string lower = InLowerCase(symbol);
    const auto* unit =
        std::ranges::find_if(kUnits, [&](const Unit& known) { return InLowerCase(known.symbol) == lower; });
    if (unit == std::end(kUnits)) return std::nullopt;
    text = number + std::string(unit->symbol);
    wrong += std::string(wrong.empty() ? "" : ", and ") + "the unit is written " + std::string(unit->symbol);
  }
  if (wrong.empty() || !TakeMeasure(text)) return std::nullopt;
  return wrong + ": write " + text;
}

/// A measure of one of the kinds asked for; `fits` names examples for the message.
Result<Measure> Parse(std::string_view text, std::string_view option, std::initializer_list<Kind> kinds,
                      std::string_view fits) {
  const auto measure = TakeMeasure(text);
  if (!measure) {
    if (const auto advice = AdviceOn(text)) return Wrong(option, text, *advice);
    if (EndsOfOtherRange(text))
      return Wrong(option, text, "one quantity belongs here, not a range; write " + std::string(fits));
    return Wrong(option, text, "not a quantity; write " + std::string(fits));
  }
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

/// Refuses a range that is not written with two dots, where one is legal.
Result<void> CheckRange(std::string_view text, std::string_view option) {
  if (text.find("..") != text.npos && text.find("...") == text.npos) return {};
  if (TakeMeasure(text)) return {};
  const auto ends = EndsOfOtherRange(text);
  if (!ends) return {};
  return Wrong(option, text, "a range has two dots between its ends: write " + ends->first + ".." + ends->second);
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
  if (auto good = CheckRange(text, option); !good) return PassOn(good);
  for (const std::string_view part : parts) {
    auto value = parse(part, option);
    const auto advice = value || !list ? std::nullopt : AdviceOn(text);
    if (advice) return Wrong(option, text, *advice);
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

/// "2,8": a list of two, or a marked f-number with a comma for a point? Who writes f/ in a list means a list.
bool MayBeMarked(std::string_view text) {
  constexpr std::array<std::string_view, 12> kMarked = {"0,9", "1,1", "1,2", "1,4", "1,8", "2,2",
                                                        "2,8", "3,5", "4,5", "5,6", "6,3", "7,1"};
  return std::ranges::find(kMarked, text) != kMarked.end();
}

/// lensctl prints a depth twice, `2.31 m (0.433 D)`: the first of them, or the second of `past infinity (-0.1 D)`.
std::string_view WithoutTwin(std::string_view text) {
  const std::size_t bracket = text.find(" (");
  if (bracket == text.npos || !text.ends_with(')')) return text;
  const std::string_view first = text.substr(0, bracket);
  const std::string_view twin = text.substr(bracket + 2, text.size() - bracket - 3);
  if (first == "past infinity") return twin;
  return TakeMeasure(twin) || IsInfinity(twin) || twin == "past infinity" ? first : text;
}

Result<Depth> ParseSubject(std::string_view text, std::string_view option) {
  auto depth = ParseDepth(text, option);
  if (depth && depth->value < 0.0) {
    return Wrong(option, text, "a negative vergence is past infinity, where there are no subjects; write 0D or inf");
  }
  return depth;
}

/// `1/250s`, as cameras show it.
std::optional<double> SecondsOfFraction(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == text.npos) return std::nullopt;
  const auto above = TakeMeasure(text.substr(0, slash));
  const std::string below = InAscii(text.substr(slash + 1));
  std::string_view symbol = below;
  const auto divisor = Decimal::TakeFrom(symbol);
  SkipSpaces(symbol);
  const Unit* unit = FindUnit(symbol);
  if (!above || above->kind != Kind::Plain || !divisor || !divisor->IsPositive()) return std::nullopt;
  if (unit == nullptr || unit->kind != Kind::Time) return std::nullopt;
  const auto whole = (above->value * Decimal(unit->integer, unit->exponent)).Nearest();
  if (!whole || !divisor->Nearest()) return std::nullopt;
  return *whole / *divisor->Nearest();
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
  if (auto good = CheckRange(text, option); !good) return PassOn(good);
  const auto [first, second] = SplitRange(text);
  auto low = ParseExactLength(first, option);
  if (!low) return PassOn(low);
  auto high = ParseExactLength(second, option);
  if (!high) return PassOn(high);
  if (*high < *low) std::swap(*low, *high);
  return Span<Decimal>{*std::move(low), *std::move(high)};
}

Result<Depth> ParseDepth(std::string_view written, std::string_view option) {
  const std::string_view text = WithoutTwin(written);
  if (IsInfinity(text)) return Depth{};
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
  if (auto good = CheckRange(text, option); !good) return PassOn(good);
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
  const std::string ascii = InAscii(text);
  std::string_view rest = ascii;
  if (rest.starts_with("1:")) rest.remove_prefix(2);  // as lenses are engraved
  if (rest.starts_with('f') || rest.starts_with('F')) rest.remove_prefix(1);
  if (rest.size() < ascii.size() && rest.starts_with('/')) rest.remove_prefix(1);
  const auto measure = TakeMeasure(rest);
  if (!measure || measure->kind != Kind::Plain) {
    if (const auto advice = AdviceOn(rest)) return Wrong(option, text, *advice);
    return Wrong(option, text, "not an f-number; write a number without a unit, such as 2.8 or f/2.8");
  }
  if (!measure->value.IsPositive()) return Wrong(option, text, "an f-number must be greater than zero");
  return Representable(measure->value, text, option);
}

Result<Openings> ParseFNumbers(std::string_view text, std::string_view option) {
  if (MayBeMarked(text)) {
    const std::string low(text.substr(0, 1)), high(text.substr(2));
    return Wrong(option, text,
                 "write " + low + "." + high + " for one f-number, or f/" + low + ",f/" + high + " for a list of two");
  }
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
  constexpr std::string_view kTimes = "a time in ns us ms s min h, such as 500ms or 1/250s";
  constexpr double kLongestS = 9e9;
  std::optional<double> seconds = SecondsOfFraction(text);
  if (!seconds) {
    const auto measure = Parse(text, option, {Kind::Time}, kTimes);
    if (!measure) return PassOn(measure);
    seconds = measure->value.Nearest();
  }
  if (!seconds || *seconds < 0.5e-9 || *seconds > kLongestS) return Wrong(option, text, "must be between 1ns and 9e9s");
  return Duration{std::llround(*seconds * 1e9)};
}

Result<Decimal> ParseNumber(std::string_view text, std::string_view option) {
  const auto measure = Parse(text, option, {Kind::Plain}, "a plain number");
  if (!measure) return PassOn(measure);
  return Representable(measure->value, text, option);
}

}  // namespace lensd::cli
