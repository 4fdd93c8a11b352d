// Quantities with their units. A number's decimal exponent takes the unit's, so that "850mm" is the double nearest to
// 0.85.
#include "quantities.h"

#include <charconv>
#include <optional>
#include <string_view>

#include "lensd/client.h"

namespace lensd {
inline namespace v1 {
namespace {

[[noreturn]] void ThrowBadText(std::string_view text, const std::string& why) {
  throw LensdError("BadText", "'" + std::string(text) + "' " + why);
}

/// The length of the number that a text begins with: sign, digits with a point, exponent. 0: none.
std::size_t NumberLength(std::string_view text) {
  const auto digits = [&](std::size_t at) {
    while (at < text.size() && text[at] >= '0' && text[at] <= '9') ++at;
    return at;
  };
  const std::size_t begin = !text.empty() && (text[0] == '+' || text[0] == '-') ? 1 : 0;
  std::size_t end = digits(begin);
  std::size_t count = end - begin;
  if (end < text.size() && text[end] == '.' && text.substr(end, 2) != "..") {
    const std::size_t after = digits(end + 1);
    count += after - end - 1;
    end = after;
  }
  if (count == 0) return 0;
  if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    const std::size_t sign = end + 1 < text.size() && (text[end + 1] == '+' || text[end + 1] == '-') ? 1 : 0;
    if (const std::size_t after = digits(end + 1 + sign); after > end + 1 + sign) end = after;
  }
  return end;
}

/// number * 10^exponent, rounded once.
std::optional<double> Scaled(std::string_view number, int exponent) {
  if (number.substr(0, 1) == "+") number.remove_prefix(1);
  const auto e = number.find_first_of("eE");
  int own = 0;
  if (e != std::string_view::npos) {
    auto digits = number.substr(e + 1);
    if (digits.substr(0, 1) == "+") digits.remove_prefix(1);
    if (std::from_chars(digits.data(), digits.data() + digits.size(), own).ec != std::errc()) return std::nullopt;
  }
  const std::string text =
      std::string(number.substr(0, e)) + "e" + std::to_string(static_cast<long long>(own) + exponent);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> Number(std::string_view text) {
  if (text.empty() || NumberLength(text) != text.size()) return std::nullopt;
  return Scaled(text, 0);
}

struct Unit {
  std::string_view symbol;
  int exponent;        // of ten
  long double factor;  // beside it
};
constexpr Unit kUnits[] = {{"nm", -9, 1}, {"um", -6, 1}, {"\u00b5m", -6, 1}, {"\u03bcm", -6, 1}, {"mm", -3, 1},
                           {"cm", -2, 1}, {"m", 0, 1},   {"km", 3, 1},       {"in", -4, 254},    {"ft", -4, 3048}};

/// A length times 10^`exponent`, from metres; nothing: no length.
std::optional<double> Length(std::string_view text, int exponent) {
  const std::size_t digits = NumberLength(text);
  const std::string_view unit = text.substr(digits);
  if (digits == 0) return std::nullopt;
  for (const Unit& known : kUnits) {
    if (unit != known.symbol) continue;
    const auto value = Scaled(text.substr(0, digits), known.exponent + exponent);
    if (!value || known.factor == 1) return value;
    const auto count = Scaled(text.substr(0, digits), 0);  // whole inches and feet are exact
    const long double tens = *Scaled("1", -(known.exponent + exponent));
    return static_cast<double>(*count * known.factor / tens);
  }
  if (unit.substr(0, 2) == "ft" && unit.size() > 4 && unit.substr(unit.size() - 2) == "in") {
    const auto feet = Number(text.substr(0, digits));
    const auto inches = Number(unit.substr(2, unit.size() - 4));
    if (!feet || !inches || *feet < 0 || unit[2] == '-' || unit[2] == '+') return std::nullopt;
    const long double tens = *Scaled("1", 4 - exponent);
    return static_cast<double>((*feet * 3048.0L + *inches * 254.0L) / tens);
  }
  return std::nullopt;
}

double Native(std::string_view text, std::string_view whole) {
  const auto number = Number(text);
  if (!number) ThrowBadText(whole, "lacks its number of native units, as in @1200, +50 or near:10");
  return *number;
}

bool IsSigned(std::string_view text) {
  return !text.empty() && (text[0] == '+' || text[0] == '-');
}

/// "@1200", "+50", "-50".
std::optional<Target> Steps(std::string_view text) {
  if (text.substr(0, 1) == "@") return Target().position(Native(text.substr(1), text));
  if (IsSigned(text) && Number(text)) return Target().relative(*Number(text));
  return std::nullopt;
}

struct Place {
  bool vergence = false;
  double value = 0.0;
};

Place PlaceOf(std::string_view text) {
  if (text == "inf") return {true, 0.0};
  if (!text.empty() && text.back() == 'D') {
    if (const auto vergence = Number(text.substr(0, text.size() - 1))) return {true, *vergence};
  }
  const auto distance = Length(text, 0);
  if (!distance) ThrowBadText(text, "is not a distance (0.8m, 33in), a vergence (2.5D) or inf");
  if (IsSigned(text) || *distance <= 0.0) {
    ThrowBadText(text, "is no distance: those are above 0 and have no sign; +N and -N are counts of steps");
  }
  return {false, *distance};
}

Depth DepthOf(std::string_view text) {
  const Place place = PlaceOf(text);
  return place.vergence ? Depth().vergenceD(place.value) : Depth().distanceM(place.value);
}

BlurLimit Limit(const char* kind, std::string_view where, std::string_view limit) {
  const auto dots = where.find("..");
  const auto far = dots == std::string_view::npos ? where : where.substr(dots + 2);
  BlurLimit wanted;
  wanted.kind(kind).depths({DepthInterval().oneEnd(DepthOf(where.substr(0, dots))).otherEnd(DepthOf(far))});
  const bool in_pixels = limit.size() > 2 && limit.substr(limit.size() - 2) == "px";
  const auto size = in_pixels ? Number(limit.substr(0, limit.size() - 2)) : Length(limit, 6);
  if (!size) ThrowBadText(limit, "is not the diameter of a blur, such as 8um or 1.5px");
  return in_pixels ? wanted.limitPx(*size) : wanted.limitUm(*size);
}

}  // namespace

Target FocusTarget(const std::string& text) {
  const std::string_view view = text;
  if (view.substr(0, 5) == "near:") return Target().nearer(Native(view.substr(5), view));
  if (view.substr(0, 4) == "far:") return Target().nearer(-Native(view.substr(4), view));
  if (view.substr(0, 4) == "ext:") {
    const auto extension = Length(view.substr(4), 3);
    if (!extension) ThrowBadText(view, "lacks its length, as in ext:2.6mm");
    return Target().extensionMm(*extension);
  }
  if (const auto steps = Steps(view)) return *steps;
  const Place place = PlaceOf(view);
  return place.vergence ? Target().vergenceD(place.value) : Target().distanceM(place.value);
}

Target ApertureTarget(const std::string& text) {
  std::string_view view = text;
  if (const auto steps = Steps(view)) return *steps;
  if (view.substr(0, 1) == "f" || view.substr(0, 1) == "F") view.remove_prefix(view.substr(1, 1) == "/" ? 2 : 1);
  const auto number = Number(view);
  if (!number || *number <= 0.0) ThrowBadText(text, "is not an f-number such as 2.8 or f/2.8");
  return Target().fNumber(*number);
}

Target ZoomTarget(const std::string& text) {
  const std::string_view view = text;
  if (const auto steps = Steps(view)) return *steps;
  const auto length = Length(view, 3);
  if (!length || *length <= 0.0 || IsSigned(view))
    ThrowBadText(view, "is not a focal length such as 35mm; @N is a position");
  return Target().focalLengthMm(*length);
}

BlurLimit Sharp(const std::string& where, const std::string& limit) {
  return Limit("sharp", where, limit);
}

BlurLimit Blurred(const std::string& where, const std::string& limit) {
  return Limit("blurred", where, limit);
}

}  // namespace v1
}  // namespace lensd
