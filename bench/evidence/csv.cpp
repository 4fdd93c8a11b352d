// Reading and writing cells.
#include "bench/evidence/csv.h"

#include <utility>

namespace lensd::bench {

std::string QuotedCell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::vector<std::vector<std::string>> CellsOf(const std::string& text) {
  std::vector<std::vector<std::string>> lines;
  std::vector<std::string> line;
  std::string cell;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"' && quoted && i + 1 < text.size() && text[i + 1] == '"') {
      cell += text[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (quoted || (c != ',' && c != '\n')) {
      cell += c;
    } else {
      line.push_back(std::exchange(cell, {}));
      if (c == '\n') lines.push_back(std::exchange(line, {}));
    }
  }
  if (!cell.empty() || !line.empty()) {
    line.push_back(cell);
    lines.push_back(line);
  }
  return lines;
}

}  // namespace lensd::bench
