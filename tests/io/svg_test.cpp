// Charts are well-formed files that stay inside their frame, whatever the data.
#include "io/svg.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <regex>
#include <string>
#include <tuple>
#include <vector>

namespace lensd::io {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Every element is closed in order: what makes a file open in a browser at all.
bool WellFormed(const std::string& svg) {
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z]+)[^>]*?(/?)>");
  for (std::sregex_iterator found(svg.begin(), svg.end(), tag), end; found != end; ++found) {
    if ((*found)[1] == "/") {
      if (open.empty() || open.back() != (*found)[2]) return false;
      open.pop_back();
    } else if ((*found)[3] != "/") {
      open.push_back((*found)[2]);
    }
  }
  return open.empty();
}

/// The largest coordinate that any line, path or text uses.
double LargestCoordinate(const std::string& svg) {
  double largest = 0.0;
  const std::regex number("-?[0-9]+\\.[0-9]{2}");
  for (std::sregex_iterator found(svg.begin(), svg.end(), number), end; found != end; ++found) {
    largest = std::max(largest, std::abs(std::stod(found->str())));
  }
  return largest;
}

Chart Example() {
  Chart chart{.title = "Blur & distance <f/2>"};
  chart.x = {.label = "distance", .unit = "m", .scale = Scale::Log};
  chart.y = {.label = "blur", .unit = "px", .low = 0.0, .high = 10.0};
  chart.lines.push_back({.name = "planned", .points = {{0.5, 3.0}, {2.0, 0.1}, {8.0, 1e9}}, .label = "planned"});
  chart.bars.push_back({.name = "limit", .x_low = 1.0, .x_high = 2.0, .label = "at most 1 px", .hatched = true});
  chart.points.push_back({.name = "measured", .points = {{{1.0, 1.0}, "here"}}});
  chart.notes.push_back({.at = {2.0, 2.0}, .text = "note", .dx = 20.0, .dy = -20.0});
  return chart;
}

TEST(Svg, ShowsTitlesUnitsAndLegendEscaped) {
  const std::string svg = ChartSvg(Example());
  EXPECT_TRUE(WellFormed(svg)) << svg;
  for (const char* text : {"Blur &amp; distance &lt;f/2&gt;", ">distance [m]<", ">blur [px]<", ">limit<", ">measured<",
                           ">at most 1 px<", ">here<", ">note<"}) {
    EXPECT_THAT(svg, HasSubstr(text));
  }
}

TEST(Svg, StaysInsideItsFrameWhateverTheData) {
  Chart chart = Example();
  const double infinity = std::numeric_limits<double>::infinity();
  chart.lines.push_back({.points = {{1.0, std::nan("")}, {-3.0, 1.0}, {infinity, 2.0}, {1e300, -1e300}, {2.0, 3.0}}});
  chart.areas.push_back({.corners = {{0.1, 1.0}, {1e200, 1e200}, {infinity, 1.0}}});
  chart.intervals.push_back({.at = {1.0, 5.0}, .low = -1e30, .high = infinity});
  chart.points.push_back({.points = {{{0.0, 1.0}, "zero has no logarithm"}}});
  const std::string svg = ChartSvg(chart);
  EXPECT_TRUE(WellFormed(svg));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  EXPECT_LE(LargestCoordinate(svg), 900.0);
}

/// x, y and the text itself of every text.
std::vector<std::tuple<double, double, std::string>> Texts(const std::string& svg) {
  std::vector<std::tuple<double, double, std::string>> texts;
  const std::regex text("<text x=\"([0-9.-]+)\" y=\"([0-9.-]+)\"[^>]*>([^<]*)<");
  for (std::sregex_iterator found(svg.begin(), svg.end(), text), end; found != end; ++found) {
    texts.emplace_back(std::stod((*found)[1]), std::stod((*found)[2]), (*found)[3]);
  }
  return texts;
}

/// Crowds of marks: the frame grows until each label has a place of its own inside the chart.
TEST(Svg, LabelsNeverMeetWhereTheFrameMayGrow) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    const double spread = seed % 2 == 0 ? 25.0 : 5.0;
    std::normal_distribution<double> place(50.0, spread);
    std::uniform_int_distribution<int> letters(3, 16);
    Chart chart{.legend = LegendPlace::None, .width = 720, .frame_height = 330.0};
    chart.x = {.low = 0.0, .high = 100.0, .ticks = {{0.0, ""}}};
    chart.y = {.low = 0.0, .high = 100.0, .ticks = {{0.0, ""}}};
    chart.points.resize(1);
    for (unsigned i = 0; i < 5 + seed % 16; ++i) {
      const ChartPoint at{std::clamp(place(random), 0.0, 100.0), std::clamp(place(random), 0.0, 100.0)};
      chart.points[0].points.push_back({at, std::string(static_cast<std::size_t>(letters(random)), 'n')});
    }
    const std::string svg = ChartSvg(chart);
    std::vector<std::array<double, 4>> boxes;
    const std::regex text("<text x=\"([0-9.-]+)\" y=\"([0-9.-]+)\"[^>]*text-anchor=\"([a-z]+)\"[^>]*>(n+)<");
    for (std::sregex_iterator found(svg.begin(), svg.end(), text), end; found != end; ++found) {
      const double x = std::stod((*found)[1]), y = std::stod((*found)[2]);
      const double width = 0.63 * 12.5 * static_cast<double>((*found)[4].length());
      const double left = x - ((*found)[3] == "middle" ? 0.5 : (*found)[3] == "end" ? 1.0 : 0.0) * width;
      boxes.push_back({left, y - 9.0, left + width, y + 2.0});
      EXPECT_TRUE(left >= 0.0 && left + width <= 720.0) << seed;
    }
    ASSERT_EQ(boxes.size(), chart.points[0].points.size()) << seed;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t k = i + 1; k < boxes.size(); ++k) {
        const auto &a = boxes[i], &b = boxes[k];
        EXPECT_FALSE(a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]) << seed << ": " << i << ", " << k;
      }
    }
  }
}

TEST(Svg, BreaksCaptionsIntoLinesBelowTheChart) {
  Chart chart = Example();
  chart.captions = {"One.", ""};
  for (int i = 0; i < 40; ++i) chart.captions[1] += "twelve words ";
  const auto texts = Texts(ChartSvg(chart));
  const auto first = std::ranges::find(texts, "One.", [](const auto& text) { return std::get<2>(text); });
  for (auto other = texts.begin(); other != first; ++other) {
    EXPECT_LT(std::get<1>(*other), std::get<1>(*first) - 12.0) << std::get<2>(*other);
  }
  std::string words;
  double last = 0.0;
  for (auto line = first; line != texts.end(); ++line) {
    const auto& [x, y, text] = *line;
    EXPECT_GE(y, last + 15.0) << text;
    EXPECT_LE(text.size(), 130u);
    last = y;
    words += text + " ";
  }
  EXPECT_EQ(words, "One. " + chart.captions[1]);
  std::smatch height;
  const std::string svg = ChartSvg(chart);
  ASSERT_TRUE(std::regex_search(svg, height, std::regex("viewBox=\"0 0 [0-9.]+ ([0-9.]+)\"")));
  EXPECT_LT(last, std::stod(height[1]) - 5.0);
}

TEST(Svg, DrawsWithoutAnyData) {
  const std::string svg = ChartSvg(Chart{});
  EXPECT_TRUE(WellFormed(svg));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Svg, LinesUpSeveralChartsWithDistinctPatterns) {
  const std::string svg = ChartsSvg({Example(), Example(), Example()}, 2);
  EXPECT_TRUE(WellFormed(svg));
  EXPECT_THAT(svg, HasSubstr("translate(860.00 0.00)"));
  EXPECT_THAT(svg, HasSubstr("translate(0.00 480.00)"));
  EXPECT_THAT(svg, HasSubstr("id=\"hatch0-0\""));
  EXPECT_THAT(svg, HasSubstr("id=\"hatch2-0\""));
}

}  // namespace
}  // namespace lensd::io
