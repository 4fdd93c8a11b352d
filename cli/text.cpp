#include "cli/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

namespace lensd::cli {
namespace {

std::size_t Characters(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

bool IsNumber(const std::string& cell) {
  return cell.find_first_not_of("0123456789.eE+- %") == std::string::npos;
}

}  // namespace

std::string Short(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

std::string LengthText(Metres length) {
  const double size = std::abs(length.value);
  if (size >= 1.0) return Short(length.value) + " m";
  if (size >= 1e-3) return Short(length.value * 1e3, 5) + " mm";
  return Short(length.value * 1e6) + " um";
}

std::string DepthText(Dioptres vergence) {
  const std::string dioptres = " (" + Short(vergence.value) + " D)";
  if (vergence.value == 0.0) return "infinity" + dioptres;
  if (vergence.value < 0.0) return "past infinity" + dioptres;
  return LengthText({1.0 / vergence.value}) + dioptres;
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
