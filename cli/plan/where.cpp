// Reads WHERE of `--sharp` and `--blurred`: a range, a distance, a tilted plane or a class of a mask.
#include "cli/plan/where.h"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

namespace lensd::cli {
namespace {

using optics::LimitKind;
using optics::Side;

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const auto end = std::min(text.find(separator, start), text.size());
    parts.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

bool IsLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

Result<std::string> CheckedName(std::string_view name, std::string_view option, std::string_view text) {
  const bool plain = !name.empty() && IsLetter(name[0]) && std::ranges::all_of(name, [](char c) {
    return IsLetter(c) || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
  if (!plain) return Wrong(option, text, "a name starts with a letter and has only letters, digits, - and _");
  for (const std::string_view taken : {"focus", "fNumber", "extension", "depth"}) {
    if (name == taken) return Wrong(option, text, "this name is taken; choose another");
  }
  return std::string(name);
}

Result<Decimal> ParsePlaneTerm(std::string_view term, std::string_view option, std::string_view text) {
  if (term.ends_with('D')) term.remove_suffix(1);
  auto number = ParseNumber(term, option);
  if (!number)
    return Wrong(option, text, "plane(U0,UX,UY) takes three vergences in dioptres, such as plane(0.8,0.3,0)");
  return number;
}

Result<TiltedPlane> ParsePlane(std::string_view where, std::string_view option, std::string_view text) {
  const bool closed = where.ends_with(')');
  const auto terms = closed ? Split(where.substr(6, where.size() - 7), ',') : std::vector<std::string_view>();
  if (terms.size() != 3) {
    return Wrong(option, text, "plane(U0,UX,UY) takes three vergences in dioptres, such as plane(0.8,0.3,0)");
  }
  TiltedPlane plane;
  Decimal* const places[] = {&plane.u0, &plane.ux, &plane.uy};
  for (std::size_t i = 0; i < 3; ++i) {
    auto term = ParsePlaneTerm(terms[i], option, text);
    if (!term) return PassOn(term);
    *places[i] = *std::move(term);
  }
  return plane;
}

Result<MaskClass> ParseClass(std::string_view where, std::string_view option, std::string_view text) {
  const auto digits = where.substr(1);
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  if (!whole || number < 1 || number > 255) return Wrong(option, text, "classes of the mask are @1 to @255");
  return MaskClass{number};
}

Result<void> ParseWhere(std::string_view where, std::string_view option, std::string_view text, WrittenLimit& limit) {
  if (where.empty()) return Wrong(option, text, "say where: NEAR..FAR, one distance, plane(U0,UX,UY) or @CLASS");
  if (where.starts_with("plane(")) {
    auto plane = ParsePlane(where, option, text);
    if (!plane) return PassOn(plane);
    limit.where = *std::move(plane);
  } else if (where[0] == '@') {
    auto mask_class = ParseClass(where, option, text);
    if (!mask_class) return PassOn(mask_class);
    limit.where = *mask_class;
  } else {
    auto range = ParseDepthRange(where, option);
    if (!range) return PassOn(range);
    limit.where = *std::move(range);
  }
  return {};
}

}  // namespace

Result<WrittenLimit> ParseLimit(std::string_view text, LimitKind kind) {
  const std::string_view option = kind == LimitKind::Sharp ? "--sharp" : "--blurred";
  WrittenLimit written;
  auto rest = text;
  if (const auto equals = text.find('='); equals != std::string_view::npos) {
    auto name = CheckedName(text.substr(0, equals), option, text);
    if (!name) return PassOn(name);
    written.name = *std::move(name);
    rest.remove_prefix(equals + 1);
  }
  auto parts = Split(rest, ':');
  if (const auto where = ParseWhere(parts[0], option, text, written); !where) return PassOn(where);
  if (parts.size() > 1 && (parts.back() == "behind" || parts.back() == "front")) {
    if (kind == LimitKind::Sharp) return Wrong(option, text, "a side is for --blurred only");
    written.side = parts.back() == "behind" ? Side::Behind : Side::Front;
    parts.pop_back();
  }
  if (parts.size() > 2) return Wrong(option, text, "write [NAME=]WHERE[:LIMIT][:behind|:front]");
  if (parts.size() == 2) {
    auto limit = ParseBlur(parts[1], option);
    if (!limit) return PassOn(limit);
    written.limit = *std::move(limit);
  }
  return written;
}

}  // namespace lensd::cli
