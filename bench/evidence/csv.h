// Lines of cells, as RFC 4180 quotes them.
#pragma once

#include <string>
#include <vector>

namespace lensd::bench {

/// The cell with quotes around it where it needs them.
std::string QuotedCell(const std::string& text);

/// All lines of a CSV text, cells unquoted; an end of line inside quotes belongs to its cell.
std::vector<std::vector<std::string>> CellsOf(const std::string& text);

}  // namespace lensd::bench
