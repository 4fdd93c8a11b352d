// The surface of best focus fitted to regions whose places were computed here, with errors drawn at random.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "autofocus/focus_map.h"

namespace lensd::autofocus {
namespace {

constexpr double kUm = 1e-6;

struct Truth {
  double middle = 500e-6, across = 0.0, down = 0.0, bowl = 0.0;
  double At(double x, double y) const { return middle + across * x + down * y + bowl * (x * x + y * y); }
};

/// Cells of a 5 x 4 grid over a frame of 4 : 3, in half diagonals.
std::vector<MapCell> CellsOf(const Truth& truth, double claimed, const std::function<double()>& error) {
  std::vector<MapCell> cells;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column) {
      const double x = ((column + 0.5) / 5 - 0.5) * 1.6, y = ((row + 0.5) / 4 - 0.5) * 1.2;
      MapCell cell;
      cell.place = {x, y, x * x + y * y};
      cell.position = truth.At(x, y) + error();
      cell.sigma = claimed;
      cells.push_back(cell);
    }
  }
  return cells;
}

void LoseTexture(MapCell& cell) {
  cell.position.reset();
  cell.cause = Cause::NoTexture;
  cell.reason = "nothing there";
}

TEST(SurfaceFit, ItsErrorsHoldWhatIsDrawn) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::uniform_real_distribution<double> slope(-80 * kUm, 80 * kUm);
  // What regions claim of themselves, and what they scatter beyond it.
  struct Case {
    double claimed, beyond;
  };
  for (const Case& one : {Case{1 * kUm, 0.0}, Case{0.3 * kUm, 2 * kUm}, Case{2 * kUm, 2 * kUm}}) {
    int within1 = 0, within2 = 0, outliers = 0, all = 0;
    constexpr int kDraws = 200;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Truth truth{.across = slope(random), .down = slope(random), .bowl = slope(random)};
      auto cells = CellsOf(truth, one.claimed, [&] { return std::hypot(one.claimed, one.beyond) * noise(random); });
      const auto fit = FitSurface(cells, 4 * kUm);
      ASSERT_TRUE(fit) << fit.error().reason;
      const double expected[] = {truth.middle, truth.across, truth.down, truth.bowl};
      for (std::size_t i = 0; i < 4; ++i) {
        const double off = std::abs(fit->terms[i] - expected[i]) / fit->sigmas[i];
        within1 += off < 1.0;
        within2 += off < 2.0;
        ++all;
      }
      for (const MapCell& cell : cells) outliers += cell.outlier;
    }
    const double one_sigma = static_cast<double>(within1) / all, two_sigma = static_cast<double>(within2) / all;
    printf("%d surfaces: %.1f and %.1f %% within 1 and 2 sigma, %.2f %% of the regions called outliers\n", kDraws,
           100 * one_sigma, 100 * two_sigma, outliers / (0.2 * kDraws));
    // A normal error: 68.3 and 95.4 %.
    EXPECT_GT(one_sigma, 0.63);
    EXPECT_LT(one_sigma, 0.82);
    EXPECT_GT(two_sigma, 0.92);
    EXPECT_LT(outliers, 0.025 * 20 * kDraws);
  }
}

TEST(SurfaceFit, RegionsOffTheSurfaceAreNamedAndChangeNothing) {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0.0, kUm);
  const Truth truth{.across = 50 * kUm, .down = -20 * kUm, .bowl = 30 * kUm};
  for (const std::vector<std::size_t>& wrong : {std::vector<std::size_t>{0}, {4, 9, 14, 19}, {0, 1, 5}}) {
    auto cells = CellsOf(truth, kUm, [&] { return noise(random); });
    for (const std::size_t index : wrong) *cells[index].position += 150 * kUm;
    const auto fit = FitSurface(cells, 10 * kUm);
    ASSERT_TRUE(fit) << fit.error().reason;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      EXPECT_EQ(cells[i].outlier, std::ranges::find(wrong, i) != wrong.end()) << i;
    }
    EXPECT_NEAR(fit->terms[1], truth.across, 4 * fit->sigmas[1]);
    EXPECT_LT(fit->sigmas[1], 2 * kUm);
    EXPECT_EQ(fit->used, 20 - static_cast<int>(wrong.size()));
  }
}

TEST(SurfaceFit, RefusesWhatItCannotTell) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, kUm);
  const auto drawn = [&] { return noise(random); };
  // Two walls, half of the frame each.
  auto cells = CellsOf({}, kUm, drawn);
  for (std::size_t i = 0; i < cells.size(); ++i) *cells[i].position += i % 2 != 0 ? 200 * kUm : 0.0;
  auto fit = FitSurface(cells, 10 * kUm);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().cause, Cause::SeveralDepths);
  // Texture in three regions.
  cells = CellsOf({}, kUm, drawn);
  for (std::size_t i = 3; i < cells.size(); ++i) LoseTexture(cells[i]);
  fit = FitSurface(cells, 10 * kUm);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().cause, Cause::NoTexture);
  EXPECT_NE(fit.error().reason.find("only 3 of 20"), std::string::npos) << fit.error().reason;
  // In one row: the tilt across it is open.
  cells = CellsOf({}, kUm, drawn);
  for (std::size_t i = 5; i < cells.size(); ++i) LoseTexture(cells[i]);
  fit = FitSurface(cells, 10 * kUm);
  ASSERT_FALSE(fit);
  EXPECT_NE(fit.error().reason.find("in one line"), std::string::npos) << fit.error().reason;
  // In six regions: a plane, no bowl.
  cells = CellsOf({.across = 40 * kUm}, kUm, drawn);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i % 5 == 1 || i % 5 == 2 || i % 5 == 3 || i / 5 == 1) LoseTexture(cells[i]);
  }
  fit = FitSurface(cells, 10 * kUm);
  ASSERT_TRUE(fit) << fit.error().reason;
  EXPECT_FALSE(fit->curved);
  EXPECT_NEAR(fit->terms[1], 40 * kUm, 4 * fit->sigmas[1]);
}

TEST(SurfaceFit, AMapIsOfAGridThatHasATilt) {
  const autofocus::Setup setup{.lowest = 0.0, .highest = 1e-3, .resolution = 1e-6, .blur_px = 1e-5};
  EXPECT_TRUE(MakeMapSearch(setup, {2, 12}));
  for (const MapGrid& grid : {MapGrid{1, 4}, MapGrid{5, 13}, MapGrid{0, 0}}) {
    const auto made = MakeMapSearch(setup, grid);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, Code::InvalidArgument);
  }
}

}  // namespace
}  // namespace lensd::autofocus
