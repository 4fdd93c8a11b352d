// Robust first: of many planes and bowls through as few regions as it takes, the one from which the median region is
// least far off (Rousseeuw, 1984) says which regions belong together. Those are then fitted by weighted least squares.
// Regions scatter by more than their own sigmas say: texture is no even, the target is not quite flat. How much more is
// estimated from them by asking that the weighted squares add up to their expectation (Paule and Mandel, 1982), and
// counts as error of each.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "autofocus/algebra/inverse.h"
#include "autofocus/focus_map.h"

namespace lensd::autofocus {
namespace {

constexpr std::size_t kTerms = FocusSurface::kTerms;
constexpr std::size_t kPlaneTerms = 3;
constexpr std::size_t kLeastCurved = 7, kLeastFlat = 4;  ///< regions
constexpr double kFar = 3.5;                             ///< standard deviations: an outlier
constexpr double kFloor = 0.25;                          ///< of the unit that shows
constexpr double kMostOutliers = 1.0 / 3.0;              ///< of the regions in focus
constexpr double kLeastPivot = 1e-12;
constexpr double kMostScatter = 2.5;  ///< of the unit that shows
using Terms = std::array<double, kTerms>;
using Square = std::array<Terms, kTerms>;

Terms BasisOf(const MapCell& cell) {
  return {1.0, cell.place.x, cell.place.y, cell.place.square};
}

struct Fit {
  Terms terms{};
  Square covariance{};
  double Off(const MapCell& cell) const {
    const Terms basis = BasisOf(cell);
    double at = 0.0;
    for (std::size_t i = 0; i < kTerms; ++i) at += terms[i] * basis[i];
    return *cell.position - at;
  }
};

using Cells = std::vector<const MapCell*>;

/// By weighted least squares on `count` terms; the covariance is for weights that are one over variances.
std::optional<Fit> Solve(const Cells& cells, const std::vector<double>& weights, std::size_t count) {
  Square normal{};
  Terms right{};
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Terms basis = BasisOf(*cells[c]);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) normal[i][j] += weights[c] * basis[i] * basis[j];
      right[i] += weights[c] * basis[i] * *cells[c]->position;
    }
  }
  const auto inverse = InverseOf(normal, count, kLeastPivot);
  if (!inverse) return std::nullopt;
  Fit fit{.covariance = *inverse};
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) fit.terms[i] += (*inverse)[i][j] * right[j];
  }
  return fit;
}

/// Standard deviation of the cells about the surface that the median cell is least far from.
struct Robust {
  Fit fit;
  double scale = 0.0;
};

std::optional<Robust> LeastMedian(const Cells& cells, std::size_t count) {
  constexpr int kDraws = 600;
  std::uint64_t state = 0x9e3779b97f4a7c15u;
  const auto draw = [&](std::size_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::size_t>((state >> 33) % below);
  };
  std::optional<Robust> best;
  std::vector<std::size_t> order(cells.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::vector<double> off(cells.size());
  for (int trial = 0; trial < kDraws; ++trial) {
    Cells some;
    for (std::size_t i = 0; i < count; ++i) {
      std::swap(order[i], order[i + draw(order.size() - i)]);
      some.push_back(cells[order[i]]);
    }
    const auto fit = Solve(some, std::vector<double>(count, 1.0), count);
    if (!fit) continue;
    std::ranges::transform(cells, off.begin(), [&](const MapCell* cell) { return std::abs(fit->Off(*cell)); });
    const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
    std::ranges::nth_element(off, middle);
    if (!best || *middle < best->scale) best = Robust{*fit, *middle};
  }
  // What the median is of a normal distribution, and what so few values come out too small.
  if (best) best->scale *= 1.4826 * (1.0 + 5.0 / static_cast<double>(std::max<std::size_t>(cells.size() - count, 1)));
  return best;
}

struct Scattered {
  Fit fit;
  double scatter = 0.0;
};

/// The fit whose scatter beyond the cells' own sigmas makes the weighted squares what they should be.
std::optional<Scattered> FitWithScatter(const Cells& cells, std::size_t count) {
  const double freedom = static_cast<double>(cells.size()) - static_cast<double>(count);
  std::optional<Fit> fit;
  const auto excess = [&](double scatter2) {
    std::vector<double> weights;
    for (const MapCell* cell : cells) weights.push_back(1.0 / (cell->sigma * cell->sigma + scatter2));
    fit = Solve(cells, weights, count);
    if (!fit) return 0.0;
    double sum = 0.0;
    for (std::size_t c = 0; c < cells.size(); ++c) sum += weights[c] * std::pow(fit->Off(*cells[c]), 2);
    return sum - freedom;
  };
  if (excess(0.0) <= 0.0) return fit ? std::optional(Scattered{*fit, 0.0}) : std::nullopt;
  double low = 0.0, high = 0.0;
  for (const MapCell* cell : cells) high = std::max(high, std::pow(fit->Off(*cell), 2));
  high *= static_cast<double>(cells.size());
  constexpr int kHalvings = 50;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0.0 ? low : high) = middle;
  }
  (void)excess(high);
  return fit ? std::optional(Scattered{*fit, std::sqrt(high)}) : std::nullopt;
}

Cells Found(const std::vector<MapCell>& cells) {
  Cells found;
  for (const MapCell& cell : cells) {
    if (cell.position && !cell.outlier) found.push_back(&cell);
  }
  return found;
}

/// How much worse the regions' places determine a term than ones spread over the whole frame would.
bool Determined(const Cells& cells, std::size_t count, std::size_t term) {
  constexpr double kWorst = 12.0;
  const auto fit = Solve(cells, std::vector<double>(cells.size(), 1.0), count);
  return fit && std::sqrt(fit->covariance[term][term] * static_cast<double>(cells.size())) < kWorst;
}

NoSurface TooFew(const std::vector<MapCell>& cells, std::size_t found) {
  std::array<int, 16> counts{};
  for (const MapCell& cell : cells) {
    if (!cell.position) ++counts[static_cast<std::size_t>(cell.cause)];
  }
  const auto most = std::ranges::max_element(counts);
  const auto cause = static_cast<Cause>(most - counts.begin());
  const auto example =
      std::ranges::find_if(cells, [&](const MapCell& cell) { return !cell.position && cell.cause == cause; });
  return {cause, "only " + std::to_string(found) + " of " + std::to_string(cells.size()) +
                     " regions could be focused, and a plane needs 4" +
                     (example == cells.end() ? "" : "; most often: " + example->reason)};
}

}  // namespace

std::vector<drivers::Region> RegionsOf(const MapGrid& grid) {
  std::vector<drivers::Region> regions;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      regions.push_back({static_cast<double>(column) / grid.columns, static_cast<double>(row) / grid.rows,
                         1.0 / grid.columns, 1.0 / grid.rows});
    }
  }
  return regions;
}

std::expected<FocusSurface, NoSurface> FitSurface(std::vector<MapCell>& cells, double unit) {
  for (MapCell& cell : cells) cell.outlier = false;
  const Cells all = Found(cells);
  if (all.size() < kLeastFlat) return std::unexpected(TooFew(cells, all.size()));
  const auto in_line = [] {
    return std::unexpected(NoSurface{
        Cause::NoTexture, "the regions that could be focused lie in one line: a tilt across it is not known"});
  };
  std::size_t count = all.size() >= kLeastCurved && Determined(all, kTerms, 3) ? kTerms : kPlaneTerms;
  const auto robust = LeastMedian(all, count);
  if (!robust) return in_line();
  const auto judge = [&](const Fit& fit, double scale) {
    bool changed = false;
    for (MapCell& cell : cells) {
      if (!cell.position) continue;
      cell.off = fit.Off(cell);
      const bool outlier = std::abs(cell.off) > kFar * std::hypot(std::max(scale, kFloor / kFar * unit), cell.sigma);
      changed |= std::exchange(cell.outlier, outlier) != outlier;
    }
    return changed;
  };
  judge(robust->fit, robust->scale);
  // So few regions make that scale rough: two thirds of them are good in any case that can be told.
  std::vector<MapCell*> by_off;
  for (MapCell& cell : cells) {
    if (cell.position) by_off.push_back(&cell);
  }
  std::ranges::sort(by_off, {}, [](const MapCell* cell) { return std::abs(cell->off); });
  for (std::size_t i = 0; 3 * i < 2 * by_off.size(); ++i) by_off[i]->outlier = false;
  std::optional<Scattered> fitted;
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds; ++round) {
    const Cells kept = Found(cells);
    if (kept.size() < kLeastFlat) return std::unexpected(TooFew(cells, kept.size()));
    if (kept.size() < kLeastCurved || !Determined(kept, kTerms, 3)) count = kPlaneTerms;
    if (!Determined(kept, count, 1) || !Determined(kept, count, 2)) return in_line();
    fitted = FitWithScatter(kept, count);
    if (!fitted) return in_line();
    if (!judge(fitted->fit, fitted->scatter)) break;
  }
  const std::size_t left_out = all.size() - Found(cells).size();
  if (fitted->scatter > kMostScatter * unit ||
      static_cast<double>(left_out) > kMostOutliers * static_cast<double>(all.size())) {
    const std::string far =
        left_out > 0 ? ": " + std::to_string(left_out) + " of " + std::to_string(all.size()) + " are far from it" : "";
    return std::unexpected(NoSurface{Cause::SeveralDepths, "the regions in focus lie on no one surface" + far +
                                                               "; a map needs one flat target that fills the frame"});
  }
  FocusSurface surface;
  surface.terms = fitted->fit.terms;
  // A scatter that so few regions tell is itself not well known: the factor that Student's distribution asks for at 95
  // %, a little rounded up.
  const double spare = std::max(1.0, static_cast<double>(Found(cells).size()) - static_cast<double>(count));
  const double unsure = fitted->scatter > 0.0 ? 1.0 + 1.5 / spare : 1.0;
  for (std::size_t i = 0; i < count; ++i) surface.sigmas[i] = unsure * std::sqrt(fitted->fit.covariance[i][i]);
  surface.curved = count == kTerms;
  surface.scatter = fitted->scatter;
  surface.used = static_cast<int>(Found(cells).size());
  return surface;
}

}  // namespace lensd::autofocus
