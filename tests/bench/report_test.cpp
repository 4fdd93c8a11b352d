// The page of lens-bench: texts that never meet or leave the frame, marks as CSV, honest intervals, and a guard that
// sees what is made worse on purpose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <regex>

#include "bench/evidence/csv.h"
#include "bench/report/guard.h"
#include "bench/report/page.h"

namespace lensd::bench {
namespace {

struct TextBox {
  std::string text;
  double left, top, right, bottom;
};

/// Every text of the SVG that is not turned, as wide as most fonts draw it.
std::vector<TextBox> TextsOf(const std::string& svg) {
  std::vector<TextBox> texts;
  const std::regex element(
      "<g transform=\"translate\\(([0-9.]+) ([0-9.]+)\\)|<text x=\"([0-9.-]+)\" y=\"([0-9.-]+)\" "
      "font-size=\"([0-9.]+)\""
      "[^>]*text-anchor=\"([a-z]+)\"([^>]*)>([^<]*)<");
  double across = 0.0, down = 0.0;
  for (std::sregex_iterator found(svg.begin(), svg.end(), element), end; found != end; ++found) {
    const std::smatch& match = *found;
    if (match[1].matched) {
      across = std::stod(match[1]);
      down = std::stod(match[2]);
    } else if (match[7].str().find("rotate") == std::string::npos) {
      const double x = across + std::stod(match[3]), y = down + std::stod(match[4]), size = std::stod(match[5]);
      const std::string text = match[8];
      const auto letters = std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; });
      // Measured in DejaVu Sans: 0.47 to 0.51 of the size where a text is long.
      const double width = (letters < 20 ? 0.56 : 0.52) * size * static_cast<double>(letters);
      const double left = x - (match[6] == "middle" ? 0.5 : match[6] == "end" ? 1.0 : 0.0) * width;
      texts.push_back({text, left, y - 0.75 * size, left + width, y + 0.2 * size});
    }
  }
  return texts;
}

void ExpectTextsClear(const std::string& svg, const std::string& name) {
  std::smatch size;
  ASSERT_TRUE(std::regex_search(svg, size, std::regex("viewBox=\"0 0 ([0-9.]+) ([0-9.]+)\""))) << name;
  const double width = std::stod(size[1]), height = std::stod(size[2]);
  const std::vector<TextBox> texts = TextsOf(svg);
  EXPECT_FALSE(texts.empty()) << name;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const TextBox& a = texts[i];
    EXPECT_TRUE(a.left >= 0.0 && a.top >= 0.0 && a.right <= width && a.bottom <= height) << name << ": " << a.text;
    for (std::size_t k = i + 1; k < texts.size(); ++k) {
      const TextBox& b = texts[k];
      EXPECT_FALSE(a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
          << name << ": " << a.text << " and " << b.text;
    }
  }
}

/// The committed evidence, as it is on the page.
TEST(ReportPage, NoTextOfTheCommittedEvidenceMeetsAnotherOrLeavesItsFrame) {
  const auto rows = LoadEvidence(LENSD_SOURCE_DIR "/docs/evidence/runs");
  ASSERT_TRUE(rows) << rows.error().message;
  const auto figures = AllFigures(*rows);
  EXPECT_GE(figures.size(), 20u);
  for (const Figure& figure : figures) {
    EXPECT_FALSE(figure.title.empty());
    EXPECT_FALSE(figure.read.empty()) << figure.id;
    EXPECT_FALSE(figure.means.empty()) << figure.id;
    for (const int width : {kWideChart, kNarrowChart}) {
      const std::string svg =
          std::visit([&](const auto& chart) { return io::ChartsSvg(Drawn(chart, figure.title, figure.key, width), 1); },
                     figure.chart);
      ExpectTextsClear(svg, figure.id + " at " + std::to_string(width));
      EXPECT_NE(svg.find("font-weight=\"bold\""), std::string::npos) << figure.id << " has no title";
      const auto* table = std::get_if<OutcomeChart>(&figure.chart);
      for (const std::string& method : table != nullptr ? table->methods : std::vector<std::string>{})
        EXPECT_NE(svg.find(">" + method + "<"), std::string::npos) << figure.id << " at " << width << ": " << method;
    }
  }
}

/// A line for every mark, and the page says where.
TEST(ReportPage, EveryChartLinksItsMarks) {
  const auto rows = LoadEvidence(LENSD_SOURCE_DIR "/docs/evidence/runs");
  ASSERT_TRUE(rows);
  const std::string page = PageOf(*rows);
  for (const Figure& figure : AllFigures(*rows)) {
    EXPECT_NE(page.find("<a href=\"" + figure.id + ".csv\">"), std::string::npos) << figure.id;
    const auto lines = CellsOf(MarksFileOf(figure));
    ASSERT_GE(lines.size(), 2u) << figure.id;
    for (const auto& line : lines) EXPECT_EQ(line.size(), lines.front().size()) << figure.id;
    std::size_t marks = 0;
    if (const auto* scatter = std::get_if<ScatterChart>(&figure.chart)) {
      marks = scatter->marks.size();
      for (const ChartLine& line : scatter->lines) marks += line.steps ? 0 : line.marks.size();
    } else if (const auto* dots = std::get_if<DotChart>(&figure.chart)) {
      for (const DotGroup& group : dots->groups) {
        for (const DotRow& row : group.rows) marks += row.marks.size();
      }
    } else {
      for (const auto& [name, cells] : std::get<OutcomeChart>(figure.chart).regimes)
        marks += static_cast<std::size_t>(std::ranges::count_if(cells, [](const auto& c) { return c.has_value(); }));
    }
    EXPECT_EQ(lines.size(), marks + 1) << figure.id;
  }
}

TEST(ReportPage, IsOneFileThatNeedsNothingElse) {
  const auto rows = LoadEvidence(LENSD_SOURCE_DIR "/docs/evidence/runs");
  ASSERT_TRUE(rows);
  const std::string page = PageOf(*rows);
  for (const char* outside : {"src=", "url(", "@import", "<link", "<script", "nan", "inf\""}) {
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  }
  for (const char* there : {"prefers-color-scheme:dark", "How to read it", "What it means", "evidence.csv",
                            "evidence.json", "Regimes of failure"}) {
    EXPECT_NE(page.find(there), std::string::npos) << there;
  }
}

/// After new evidence: lens-bench report -o out, and copy these three from there.
TEST(ReportPage, ReadmeShowsTheCommittedEvidence) {
  const auto rows = LoadEvidence(LENSD_SOURCE_DIR "/docs/evidence/runs");
  ASSERT_TRUE(rows);
  const auto figures = AllFigures(*rows);
  for (const char* id : {"autofocus-frames", "regimes", "need-render"}) {
    const auto figure = std::ranges::find(figures, id, &Figure::id);
    ASSERT_NE(figure, figures.end()) << id;
    std::ifstream file(std::string(LENSD_SOURCE_DIR "/docs/images/") + id + ".svg");
    const std::string shown{std::istreambuf_iterator<char>(file), {}};
    EXPECT_TRUE(shown == ChartFileOf(*figure)) << id << ".svg of docs/images is not drawn from docs/evidence/runs";
  }
}

TEST(ReportStatistics, WilsonAsInTheLiterature) {
  // Newcombe (1998), table I, method 3: 81 of 263 and 15 of 148.
  const Estimate first = ShareOf(81, 263), second = ShareOf(15, 148);
  EXPECT_NEAR(first.low, 0.2553, 5e-5);
  EXPECT_NEAR(first.high, 0.3662, 5e-5);
  EXPECT_NEAR(second.low, 0.0624, 5e-5);
  EXPECT_NEAR(second.high, 0.1605, 5e-5);
  EXPECT_EQ(ShareOf(0, 20).low, 0.0);
  EXPECT_EQ(ShareOf(20, 20).high, 1.0);
}

TEST(ReportStatistics, MediansHoldTheTruthAsOftenAsTheySay) {
  // By the textbooks the 2nd and the 8th of nine values, the 40th and the 61st of a hundred.
  std::vector<double> nine, hundred;
  for (int i = 1; i <= 9; ++i) nine.push_back(i);
  for (int i = 1; i <= 100; ++i) hundred.push_back(i);
  EXPECT_EQ(MedianOf(nine).low, 2);
  EXPECT_EQ(MedianOf(nine).middle, 5);
  EXPECT_EQ(MedianOf(nine).high, 8);
  EXPECT_EQ(MedianOf(hundred).low, 40);
  EXPECT_EQ(MedianOf(hundred).high, 61);
  std::mt19937 random(3);
  std::exponential_distribution<double> draw;
  int held = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    std::vector<double> values(11);
    for (double& value : values) value = draw(random);
    const Estimate median = MedianOf(values);
    held += median.low <= std::log(2.0) && std::log(2.0) <= median.high;
  }
  EXPECT_GE(held, 0.95 * 4000);
  EXPECT_TRUE(TooWide({1.0, 0.6, 1.1}, 9));
  EXPECT_TRUE(TooWide({1.0, 0.99, 1.01}, 5));
  EXPECT_FALSE(TooWide({1.0, 0.9, 1.1}, 9));
}

EvidenceRow Like(const std::string& method, const std::string& role) {
  return {.family = "measure",
          .scene = "1080p, \"8\" bits\nof a line",
          .method = method,
          .role = role,
          .measure = {},
          .unit = {},
          .settings = "lens-bench measure, say",
          .made = {"abc", "machine", "compiler", "2026-11-23"}};
}

TEST(ReportRows, ComeBackFromCsvAsTheyWere) {
  EvidenceRow swept =
      MedianRow(Like("lensd", "ours"), "time", "ms", {3, 1, 2.5, std::numeric_limits<double>::infinity()});
  swept.sweep = "diameter [px]";
  swept.value = 0.25;
  const std::vector<EvidenceRow> rows = {swept, ShareRow(Like("peer", "peer"), "within", 7, 9)};
  const auto back = RowsFromCsv(CsvOf(rows), "x.csv");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(CsvOf(*back), CsvOf(rows));
  EXPECT_EQ(back->at(0).scene, swept.scene);
  EXPECT_EQ(back->at(0).samples, swept.samples);
  EXPECT_EQ(back->at(0).value, 0.25);
  EXPECT_EQ(back->at(1).n, 9);
  EXPECT_FALSE(RowsFromCsv("family,scene\nmove,x\n", "x.csv"));
  EXPECT_FALSE(RowsFromCsv(CsvOf(rows) + "a,b\n", "x.csv"));
}

std::vector<EvidenceRow> Baseline() {
  return {MedianRow(Like("read memory once", "floor"), "time", "ms", {1.0, 1.1, 0.9}),
          MedianRow(Like("lensd Brenner", "ours"), "time", "ms", {2.0, 2.2, 1.8}),
          ShareRow(Like("lensd Brenner", "ours"), "within", 99, 100),
          ShareRow(Like("lensd Brenner", "ours"), "false", 0, 100),
          MedianRow(Like("lensd Brenner", "ours"), "frames", "frames", {4, 4, 4, 5, 4, 4, 4, 4, 4})};
}

TEST(ReportGuard, LetsPassWhatIsNotWorse) {
  EXPECT_TRUE(WorseThan(Baseline(), Baseline()).empty());
  auto now = Baseline();
  now[0] = MedianRow(now[0], "time", "ms", {3.0, 3.3, 2.7});  // a machine three times as slow
  now[1] = MedianRow(now[1], "time", "ms", {6.0, 6.6, 5.4});
  now[2] = ShareRow(now[2], "within", 97, 100);  // well inside the intervals
  EXPECT_TRUE(WorseThan(Baseline(), now).empty());
  now[1] = MedianRow(now[1], "time", "ms", {6.0, 66.0, 5.4});  // one bad repeat of three
  EXPECT_TRUE(WorseThan(Baseline(), now).empty());
}

TEST(ReportGuard, SeesWhatIsPlanted) {
  const auto planted = [](std::size_t row, const EvidenceRow& worse) {
    auto now = Baseline();
    now[row] = worse;
    return WorseThan(Baseline(), now);
  };
  const auto as_was = Baseline();
  EXPECT_EQ(planted(1, MedianRow(as_was[1], "time", "ms", {2.7, 2.9, 1.8})).size(), 1u)
      << "two of three repeats slower";
  EXPECT_EQ(planted(2, ShareRow(as_was[2], "within", 80, 100)).size(), 1u);
  EXPECT_EQ(planted(3, ShareRow(as_was[3], "false", 12, 100)).size(), 1u);
  EXPECT_EQ(planted(4, MedianRow(as_was[4], "frames", "frames", {6, 6, 7, 6, 6, 6, 8, 6, 6})).size(), 1u);
  auto fewer = Baseline();
  fewer.pop_back();
  EXPECT_EQ(WorseThan(Baseline(), fewer).size(), 1u) << "a figure that is no longer measured";
}

}  // namespace
}  // namespace lensd::bench
