// Depths in the unit the reader thinks in, and columns that line up.
#include "cli/text/text.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "optics/decimal.h"

namespace lensd::cli {
namespace {

std::size_t Characters(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

bool IsNumber(const std::string& cell) {
  return cell.find_first_not_of("0123456789.eE+- %") == std::string::npos;
}

DistanceUnit& Shown() {
  static DistanceUnit unit = DistanceUnit::Metres;
  return unit;
}

bool& OriginSaid() {
  static bool said = false;
  return said;
}

/// The unit of the first quantity in `NAME=2m..3m:8um`, `5ft7in`, `1.2m@3m`; nothing where it is no distance.
std::optional<DistanceUnit> UnitIn(std::string_view text) {
  if (const auto equals = text.find('='); equals != std::string_view::npos) text.remove_prefix(equals + 1);
  if (const auto at = text.find('@'); at != std::string_view::npos && at > 0) text.remove_prefix(at + 1);
  while (!text.empty()) {
    const auto end = std::min(text.find_first_of(".,:"), text.size());
    std::string_view rest = text;
    if (!optics::Decimal::TakeFrom(rest)) {
      text.remove_prefix(std::min(end + 1, text.size()));
      continue;
    }
    struct Known {
      std::string_view symbol;
      DistanceUnit unit;
    };
    static constexpr Known kKnown[] = {
        {"mm", DistanceUnit::Millimetres}, {"ft", DistanceUnit::Feet},  {"in", DistanceUnit::Inches},
        {"D", DistanceUnit::Dioptres},     {"m", DistanceUnit::Metres}, {"cm", DistanceUnit::Metres},
        {"km", DistanceUnit::Metres},      {"'", DistanceUnit::Feet},   {"\"", DistanceUnit::Inches},
    };
    rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    for (const auto& [symbol, unit] : kKnown) {
      if (rest.starts_with(symbol)) return unit;
    }
    return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

DistanceUnit UnitOfFirstDistance(std::span<const char* const> arguments) {
  static constexpr std::string_view kOptions[] = {"--focus", "--at",    "--sharp", "--blurred",
                                                  "--point", "--field", "--range"};
  const bool focuses = std::ranges::find(arguments, std::string_view("focus")) != arguments.end();
  std::string_view option;
  for (const std::string_view argument : arguments) {
    std::string_view value = argument;
    if (argument.starts_with("--")) {
      const auto equals = std::min(argument.find('='), argument.size());
      option = argument.substr(0, equals);
      value = equals < argument.size() ? argument.substr(equals + 1) : "";
    }
    const bool is_distance = std::ranges::find(kOptions, option) != std::end(kOptions) || (option.empty() && focuses);
    if (is_distance) {
      if (const auto unit = UnitIn(value)) return *unit;
    }
    if (value == argument || argument.find('=') != std::string_view::npos) option = {};
  }
  return DistanceUnit::Metres;
}

void ShowDistancesIn(DistanceUnit unit) {
  Shown() = unit;
}

DistanceUnit ShownDistanceUnit() {
  return Shown();
}

void SayWhereDistancesStart() {
  OriginSaid() = true;
}

std::string_view OriginWords() {
  return OriginSaid() ? " from the lens centre" : "";
}

std::string_view OriginLine() {
  return OriginSaid() ? "distances are from the lens centre\n" : "";
}

std::string DistanceText(Metres distance) {
  constexpr double kFar = 1e5, kNear = 1e3;  // metres: beyond, km; beyond, no mm and inches
  const double metres = distance.value;
  const DistanceUnit unit = Shown();
  if (metres < kFar && unit == DistanceUnit::Feet) return Short(metres / 0.3048) + " ft";
  if (metres < kNear && unit == DistanceUnit::Inches) return Short(metres / 0.0254) + " in";
  if (metres < kNear && unit == DistanceUnit::Millimetres) return Short(metres * 1e3, 5) + " mm";
  constexpr double kRoundsToOne = 0.99995;  // which would read 1000 mm
  if (metres >= kRoundsToOne && metres < 1.0) return "1 m";
  return LengthText(distance, metres < 1.0 ? 5 : 4);
}

std::string DepthText(Dioptres vergence) {
  constexpr double kInfinity = 1e8;  // metres
  const double distance = 1.0 / vergence.value;
  const std::string dioptres = Short(vergence.value) + " D";
  std::string place = distance >= kInfinity ? "infinity" : DistanceText({distance});
  if (vergence.value == 0.0) place = "infinity";
  if (vergence.value < 0.0) place = "past infinity";
  if (Shown() == DistanceUnit::Dioptres) return dioptres + " (" + place + ")";
  return place + " (" + dioptres + ")";
}

std::string TableText(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  std::vector<bool> numeric;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], Characters(row[i]));
  }
  const auto body = std::span(rows).subspan(std::min<std::size_t>(rows.size(), 1));
  for (std::size_t i = 0; i < widths.size(); ++i) {
    numeric.push_back(!body.empty() &&
                      std::ranges::all_of(body, [i](const auto& row) { return i < row.size() && IsNumber(row[i]); }));
  }
  std::string table;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string space(widths[i] - Characters(row[i]), ' ');
      line += (i == 0 ? "" : "  ") + (numeric[i] ? space + row[i] : row[i] + space);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    table += line + "\n";
  }
  return table;
}

}  // namespace lensd::cli
