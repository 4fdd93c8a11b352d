// The whole page as one text that needs nothing else.
#pragma once

#include <string>

#include "bench/report/figures.h"

namespace lensd::bench {

/// HTML with inline SVG, each chart drawn for wide and for narrow screens; colours follow the reader's screen.
std::string PageOf(const Evidence& rows);

/// One wide chart as an SVG file of its own, for documents. It needs no CSS; where the viewer has it, it turns dark.
std::string ChartFileOf(const Figure& figure);

/// The marks of one chart as CSV, which the page links as ID.csv.
std::string MarksFileOf(const Figure& figure);

/// Every figure of the page.
std::vector<Figure> AllFigures(const Evidence& rows);

/// The widths that charts are drawn for, px.
inline constexpr int kWideChart = 720, kNarrowChart = 368;

}  // namespace lensd::bench
