// One table of figures as CSV, JSON or text; numbers keep all digits in files and four for people.
#include "bench/outputs.h"

#include <sysexits.h>

#include <algorithm>
#include <iostream>
#include <sstream>
#include <utility>

#include "io/png.h"
#include "io/svg_colours.h"

namespace lensd::bench {
namespace {

using nlohmann::ordered_json;

std::string CellOf(const ordered_json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  return value.dump();
}

std::string CsvOf(const std::vector<ordered_json>& rows) {
  std::string text;
  const auto line = [&](const ordered_json& row, const auto& cell) {
    std::string separator;
    for (const auto& [key, value] : row.items()) text += std::exchange(separator, ",") + cell(key, value);
    text += "\n";
  };
  if (!rows.empty()) line(rows.front(), [](const std::string& key, const ordered_json&) { return key; });
  for (const ordered_json& row : rows) {
    line(row, [](const std::string&, const ordered_json& value) { return CellOf(value); });
  }
  return text;
}

/// For people: four digits are enough.
std::string ShortOf(const ordered_json& value) {
  if (!value.is_number_float()) return value.is_null() ? "-" : CellOf(value);
  std::ostringstream text;
  text.precision(4);
  text << value.get<double>();
  return text.str();
}

void PrintTable(const std::vector<ordered_json>& rows) {
  if (rows.empty()) return;
  std::vector<std::size_t> widths;
  const auto each = [&](const ordered_json& row, const auto& use) {
    std::size_t column = 0;
    for (const auto& [key, value] : row.items()) use(column++, key, ShortOf(value));
  };
  each(rows.front(), [&](std::size_t, const std::string& key, const std::string&) { widths.push_back(key.size()); });
  for (const ordered_json& row : rows) {
    each(row, [&](std::size_t i, const std::string&, const std::string& cell) {
      widths[i] = std::max(widths[i], cell.size());
    });
  }
  const auto pad = [&](std::size_t i, const std::string& cell) {
    std::cout << cell << std::string(widths[i] - cell.size() + 2, ' ');
  };
  each(rows.front(), [&](std::size_t i, const std::string& key, const std::string&) { pad(i, key); });
  std::cout << "\n";
  for (const ordered_json& row : rows) {
    each(row, [&](std::size_t i, const std::string&, const std::string& cell) { pad(i, cell); });
    std::cout << "\n";
  }
}

}  // namespace

int WriteOutputs(const std::string& command, const std::vector<ordered_json>& rows,
                 const std::vector<std::string>& missing, const Outputs& outputs,
                 const std::function<std::string()>& chart) {
  for (const std::string& peer : missing) {
    std::cerr << command << ": built without " << peer << " (script/bootstrap bench installs it)\n";
  }
  const auto write = [&](const std::string& path, const std::string& text) {
    if (path.empty()) return true;
    const auto written = io::WriteFileAtomically(path, text.data(), text.size());
    if (!written) std::cerr << command << ": " << written.error().message << "\n";
    return written.has_value();
  };
  if (!write(outputs.csv, CsvOf(rows)) ||
      !write(outputs.svg, outputs.svg.empty() ? "" : io::InTheme(chart(), io::Theme::Viewer)))
    return EX_IOERR;
  if (outputs.as_json) {
    std::cout << ordered_json(rows).dump() << "\n";
  } else {
    PrintTable(rows);
  }
  return EX_OK;
}

}  // namespace lensd::bench
