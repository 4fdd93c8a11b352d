// The grid, its weights and the peak on it. Steps grow away from the frames, so each place counts by the width it
// stands for.
#include "autofocus/defocus/posterior.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensd::autofocus::defocus {
namespace {

constexpr double kSlopes[] = {0.55, 0.65, 0.75, 0.85, 0.92, 0.96, 1.0, 1.04, 1.08, 1.17, 1.3, 1.5, 1.8};
constexpr double kKnownWell = 0.025;  // standard deviation of the slope of half of all lenses
constexpr double kKnownBadly = 0.30;  // and of the others: of its logarithm
constexpr double kFineReach = 3.0;    // px
constexpr double kFineStep = 0.25;    // px

/// How much of the slope's axis a grid point stands for.
double SlopeWidth(double slope) {
  const auto at = std::ranges::find(kSlopes, slope);
  const double low = at == std::begin(kSlopes) ? *at : *(at - 1);
  const double high = at + 1 == std::end(kSlopes) ? *at : *(at + 1);
  return 0.5 * std::log(high / low);
}

/// Grid over the range: steps grow with the distance from the nearest frame.
std::vector<double> CoarseGrid(std::span<const double> positions, Range range) {
  std::vector<double> places;
  double at = range.lowest;
  while (at < range.highest) {
    places.push_back(at);
    double nearest = std::numeric_limits<double>::infinity();
    for (const double position : positions) nearest = std::min(nearest, std::abs(at - position));
    at += std::clamp(0.05 * nearest, 0.75, 3.0);
  }
  places.push_back(range.highest);
  return places;
}

}  // namespace

double Posterior::LogSlopePrior(double slope) const {
  const double off = std::log(slope);
  const auto bell = [&](double sigma) { return std::exp(-0.5 * std::pow(off / sigma, 2)) / sigma; };
  return std::log(bell(known_well_) + bell(kKnownBadly));
}

Posterior::Posterior(const Likelihood& likelihood, Range range, double bend, double slope_sigma)
    : bend_(bend), known_well_(slope_sigma > 0 ? slope_sigma : kKnownWell) {
  Evaluate(likelihood, CoarseGrid(likelihood.positions(), range));
  const auto better = [](const Sample& a, const Sample& b) {
    return a.fit.log_likelihood + a.fit.log_prior + a.log_slope_prior <
           b.fit.log_likelihood + b.fit.log_prior + b.log_slope_prior;
  };
  const double best = std::ranges::max_element(samples_, better)->focus;
  std::vector<double> fine;
  for (double at = best - kFineReach; at <= best + kFineReach; at += kFineStep) {
    if (at >= range.lowest && at <= range.highest) fine.push_back(at);
  }
  Evaluate(likelihood, fine);
  misfit_ = std::ranges::max_element(samples_, better)->fit.excess;
  weakening_ = std::max(1.0, 1.0 + misfit_);
  Describe();
}

void Posterior::Evaluate(const Likelihood& likelihood, const std::vector<double>& places) {
  for (const double place : places) {
    for (const double slope : kSlopes)
      samples_.push_back({place, slope, LogSlopePrior(slope) + std::log(SlopeWidth(slope)),
                          likelihood.At(place, slope / (1.0 + bend_ * place))});
  }
}

/// The samples as probabilities of intervals, slopes summed, in order of focus.
std::vector<Posterior::Cell> Posterior::Cells() const {
  std::vector<std::pair<double, double>> logs;  // focus, log density times slope
  double top = -std::numeric_limits<double>::infinity();
  for (const Sample& sample : samples_) {
    const double value = sample.fit.log_likelihood / weakening_ + sample.fit.log_prior + sample.log_slope_prior;
    logs.emplace_back(sample.focus, value);
    top = std::max(top, value);
  }
  std::ranges::sort(logs);
  std::vector<Cell> cells;
  for (const auto& [focus, value] : logs) {
    if (cells.empty() || focus != cells.back().focus) cells.push_back({focus, 0.0, 0.0});
    cells.back().mass += std::exp(value - top);
  }
  double total = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double low = i > 0 ? cells[i - 1].focus : cells[i].focus;
    const double high = i + 1 < cells.size() ? cells[i + 1].focus : cells[i].focus;
    cells[i].width = 0.5 * (high - low);
    cells[i].mass *= cells[i].width;
    total += cells[i].mass;
  }
  for (Cell& cell : cells) cell.mass /= total;
  return cells;
}

void Posterior::Describe() {
  cells_ = Cells();
  const auto top =
      std::ranges::max_element(cells_, {}, [](const Cell& cell) { return cell.mass / (cell.width + 1e-12); });
  double mass = 0.0;
  double sum = 0.0;
  double square = 0.0;
  for (const Cell& cell : cells_) {
    const double off = cell.focus - top->focus;
    if (std::abs(off) > kFineReach) continue;
    mass += cell.mass;
    sum += cell.mass * off;
    square += cell.mass * (off * off + cell.width * cell.width / 12.0);
  }
  focus_ = top->focus + sum / mass;
  sigma_ = std::sqrt(std::max(square / mass - std::pow(sum / mass, 2), 0.0));
  double best = -std::numeric_limits<double>::infinity();
  for (const Sample& sample : samples_) {
    const double value = sample.fit.log_likelihood / weakening_ + sample.fit.log_prior + sample.log_slope_prior;
    if (value <= best) continue;
    best = value;
    relative_slope_ = sample.slope;
    slope_ = sample.slope / (1.0 + bend_ * sample.focus);
  }
}

double Posterior::Judge(const Likelihood& likelihood, const Peak& peak) const {
  const Fit fit = likelihood.At(peak.focus, peak.slope / (1.0 + bend_ * peak.focus));
  return fit.log_likelihood / weakening_ + fit.log_prior + LogSlopePrior(peak.slope);
}

/// The top of the peak lies between the grid's places and slopes: Newton's method finds it, and the curvature there
/// says how well the focus is known. What leads away from the peak is no answer.
std::optional<Posterior::Peak> Posterior::Climb(const Likelihood& likelihood) const {
  constexpr int kMostSteps = 8;
  constexpr double kPlaceStep = 0.06;  // px, of the differences
  constexpr double kSlopeStep = 0.004;
  constexpr double kLongestPlaceStep = 0.5;
  constexpr double kLongestSlopeStep = 0.03;
  Peak peak{.focus = focus_, .slope = relative_slope_};
  peak.height = Judge(likelihood, peak);
  for (int i = 0; i < kMostSteps; ++i) {
    const auto moved = [&](double x, double s) {
      Peak there{.focus = peak.focus + x * kPlaceStep, .slope = peak.slope + s * kSlopeStep};
      there.height = Judge(likelihood, there);
      return there;
    };
    const auto at = [&](int x, int s) { return moved(x, s).height; };
    const double right = at(1, 0), left = at(-1, 0), up = at(0, 1), down = at(0, -1);
    const double xx = right - 2 * peak.height + left;
    const double ss = up - 2 * peak.height + down;
    const double xs = 0.25 * (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1));
    const double determinant = xx * ss - xs * xs;
    if (!(xx < 0) || !(determinant > 0)) return std::nullopt;
    peak.sigma = kPlaceStep * std::sqrt(-ss / determinant);
    const double gx = 0.5 * (right - left);
    const double gs = 0.5 * (up - down);
    const double by_x = (xs * gs - ss * gx) / determinant;
    const double by_s = (xs * gx - xx * gs) / determinant;
    const double shorter = std::max(
        {std::abs(by_x) * kPlaceStep / kLongestPlaceStep, std::abs(by_s) * kSlopeStep / kLongestSlopeStep, 1.0});
    const Peak there = moved(by_x / shorter, by_s / shorter);
    const double gain = there.height - peak.height;
    if (gain > 0) peak = {there.focus, there.slope, peak.sigma, there.height};
    if (gain < 1e-4) break;
  }
  if (std::abs(peak.focus - focus_) > kFineReach) return std::nullopt;
  return peak;
}

Posterior::Peak Posterior::TopNear(const Likelihood& likelihood, const Peak& from) const {
  constexpr double kFirstStep = 0.5, kLastStep = 0.06;  // px
  constexpr double kSlopePerPx = 0.06;                  // changed together: along the valley, across it and each alone
  constexpr double kWays[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
  Peak top = from;
  top.height = Judge(likelihood, top);
  for (double step = kFirstStep; step >= kLastStep;) {
    Peak best = top;
    for (const auto& [x, s] : kWays) {
      Peak there{.focus = top.focus + x * step, .slope = top.slope + s * step * kSlopePerPx};
      there.height = Judge(likelihood, there);
      if (there.height > best.height) best = there;
    }
    if (best.height > top.height) {
      top = best;
    } else {
      step *= 0.5;
    }
  }
  top.excess = likelihood.At(top.focus, top.slope / (1.0 + bend_ * top.focus)).excess;
  return top;
}

void Posterior::Refine(const Likelihood& likelihood, Range range) {
  const auto best = Climb(likelihood);
  if (!best || best->focus < range.lowest || best->focus > range.highest) return;
  focus_ = best->focus;
  sigma_ = best->sigma;
  relative_slope_ = best->slope;
  slope_ = best->slope / (1.0 + bend_ * best->focus);
}

double Posterior::LogSlopeAt(const Likelihood& likelihood, double focus) const {
  constexpr double kReach = 1.2, kFirstStep = 0.1, kLastStep = 0.005;
  double best = 0.0;
  double top = -std::numeric_limits<double>::infinity();
  const auto look = [&](double log) {
    const Fit fit = likelihood.At(focus, std::exp(log) / (1.0 + bend_ * focus));
    if (fit.log_likelihood + fit.log_prior <= top) return false;
    top = fit.log_likelihood + fit.log_prior;
    best = log;
    return true;
  };
  for (int i = 0; i <= static_cast<int>(2.0 * kReach / kFirstStep); ++i) look(-kReach + i * kFirstStep);
  for (double step = 0.5 * kFirstStep; step >= kLastStep; step *= 0.5) {
    const double middle = best;
    if (!look(middle - step)) look(middle + step);
  }
  return best;
}

std::optional<double> Posterior::UnevenOf(const Likelihood& likelihood) const {
  constexpr double kFirstStep = 1.0, kLastStep = 0.02, kMost = 0.4;
  constexpr double kPx = 0.5, kLogSlope = 0.04, kUneven = 0.04;  // that are changed together
  struct Place {
    double focus, log_slope, uneven, height;
  };
  const auto judged = [&](double focus, double log_slope, double uneven) {
    const Fit fit = likelihood.At(focus, std::exp(log_slope) / (1.0 + bend_ * focus), uneven);
    return Place{focus, log_slope, uneven, fit.log_likelihood + fit.log_prior};
  };
  // The ridge is narrow: from several places, and what leads highest counts.
  std::optional<Place> highest;
  for (const double from : {-0.1, 0.0, 0.1}) {
    Place top = judged(focus_, std::log(relative_slope_), from);
    for (double step = kFirstStep; step >= kLastStep && std::abs(top.uneven) <= kMost;) {
      Place best = top;
      for (int way = 0; way < 27; ++way) {
        const int x = way % 3 - 1, s = way / 3 % 3 - 1, u = way / 9 - 1;
        const Place there =
            judged(top.focus + x * step * kPx, top.log_slope + s * step * kLogSlope, top.uneven + u * step * kUneven);
        if (there.height > best.height) best = there;
      }
      if (best.height > top.height) {
        top = best;
      } else {
        step *= 0.5;
      }
    }
    if (!highest || top.height > highest->height) highest = top;
  }
  if (std::abs(highest->uneven) > kMost) return std::nullopt;
  return highest->uneven;
}

double Posterior::MassNear(double position, double reach) const {
  double mass = 0.0;
  for (const Cell& cell : cells_) {
    if (std::abs(cell.focus - position) <= reach) mass += cell.mass;
  }
  return mass;
}

double Posterior::MassBelow(double position) const {
  double mass = 0.0;
  for (const Cell& cell : cells_) {
    if (cell.focus < position) mass += cell.mass;
  }
  return mass;
}

std::vector<double> Posterior::Places(double least) const {
  constexpr double kApart = 4.0;  // px of blur: nearer ones are one peak
  std::vector<double> places;
  double mass = 0.0, sum = 0.0, last = 0.0;
  const auto close = [&] {
    if (mass >= least) places.push_back(sum / mass);
    mass = sum = 0.0;
  };
  for (const Cell& cell : cells_) {
    if (cell.mass < 1e-4) continue;
    if (mass > 0 && cell.focus - last > kApart) close();
    mass += cell.mass;
    sum += cell.mass * cell.focus;
    last = cell.focus;
  }
  close();
  return places;
}

double Posterior::TypicalDistance(double position) const {
  std::vector<std::pair<double, double>> distances;
  for (const Cell& cell : cells_) distances.emplace_back(std::abs(cell.focus - position), cell.mass);
  std::ranges::sort(distances);
  double mass = 0.0;
  for (const auto& [distance, part] : distances) {
    mass += part;
    if (mass >= 0.5) return distance;
  }
  return distances.back().first;
}

}  // namespace lensd::autofocus::defocus
