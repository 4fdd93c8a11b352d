// The page of lens-bench: labels that never meet or leave the frame, honest intervals, and a guard that sees what is
// made worse on purpose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "bench/evidence/csv.h"
#include "bench/report/guard.h"
#include "bench/report/labels.h"
#include "bench/report/page.h"

namespace lensd::bench {
namespace {

const Box kFrame{50, 20, 600, 330};

std::vector<Labelled> Crowd(unsigned seed, int count, double spread) {
  std::mt19937 random(seed);
  std::normal_distribution<double> x(300, spread), y(180, 0.5 * spread);
  std::uniform_real_distribution<double> width(20, 110);
  std::vector<Labelled> marks;
  for (int i = 0; i < count; ++i) {
    marks.push_back({std::clamp(x(random), 50.0, 650.0), std::clamp(y(random), 20.0, 350.0), width(random), 14});
  }
  return marks;
}

TEST(ReportLabels, NeverMeetNorLeaveTheFrame) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    const auto marks = Crowd(seed, 5 + static_cast<int>(seed % 16), seed % 2 == 0 ? 150 : 30);
    const auto places = PlaceLabels(kFrame, marks, {});
    ASSERT_TRUE(places) << seed;
    for (std::size_t i = 0; i < marks.size(); ++i) {
      EXPECT_TRUE(Within((*places)[i].box, kFrame)) << seed;
      for (std::size_t k = 0; k < marks.size(); ++k) {
        const Box mark{marks[k].x - kMarkRadius, marks[k].y - kMarkRadius, 2 * kMarkRadius, 2 * kMarkRadius};
        EXPECT_FALSE(Overlap((*places)[i].box, mark)) << seed << ": label " << i << " on mark " << k;
        if (k > i) {
          EXPECT_FALSE(Overlap((*places)[i].box, (*places)[k].box)) << seed << ": " << i << ", " << k;
        }
      }
    }
  }
}

TEST(ReportLabels, SayWhereThereIsNoRoom) {
  EXPECT_FALSE(PlaceLabels({0, 0, 60, 30}, Crowd(1, 10, 5), {}));
  EXPECT_FALSE(PlaceLabels({0, 0, 100, 100}, {{50, 50, 20, 14}}, {{0, 0, 100, 100}}));
}

void ExpectTextsClear(const Drawing& drawing, const std::string& name) {
  const auto& texts = drawing.texts();
  EXPECT_FALSE(texts.empty()) << name;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    EXPECT_TRUE(Within(texts[i], drawing.frame())) << name << ": text " << i << " leaves the frame at " << texts[i].x
                                                   << ", " << texts[i].y << ", width " << texts[i].width;
    for (std::size_t k = i + 1; k < texts.size(); ++k) {
      EXPECT_FALSE(Overlap(texts[i], texts[k]))
          << name << ": texts " << i << " and " << k << " at " << texts[i].x << ", " << texts[i].y;
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
    for (const double width : {kWideChart, kNarrowChart}) {
      std::visit([&](const auto& chart) { ExpectTextsClear(Draw(chart, width), figure.id + " at " + Short(width)); },
                 figure.chart);
    }
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
