// No bounds, no blocks: each position is asked about each limit, in the order that decides between equals.
#include "position_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

namespace lensd::optics {

namespace {

constexpr double kNoEnd = std::numeric_limits<double>::infinity();

class Scan {
 public:
  Scan(const LensPositions& lens, const PositionBlur& blur, const std::vector<std::size_t>& focus,
       const std::vector<std::size_t>& iris)
      : lens_(lens), blur_(blur), focus_(focus), iris_(iris) {
    for (const IrisPosition& position : lens.iris) n_.push_back(blur.FNumbers(position));
    for (const std::size_t j : iris) {
      highest_low_ = std::max(highest_low_, n_[j].first);
      lowest_high_ = std::min(lowest_high_, n_[j].second);
    }
  }

  /// Smallest f-number that holds; there the least ratio, then the first position.
  std::optional<PositionPair> Brightest() {
    std::optional<PositionPair> best;
    std::size_t best_at = 0;
    for (const std::size_t i : focus_) {
      Ask(i);
      double least = 0.0, most = kNoEnd;
      for (const OpeningNeed& need : needs_) {
        const double n = need.geometric / need.limit;
        need.sharp ? least = std::max(least, n) : most = std::min(most, n);
      }
      if (most * kPositionHolds < lowest_high_ || least > highest_low_ * kPositionHolds) continue;
      for (std::size_t at = 0; at < iris_.size(); ++at) {
        const double n = lens_.iris[iris_[at]].f_number.value;
        if (n < least / kPositionHolds) continue;
        if (n > most * kPositionHolds) break;
        const double ratio = Worst(iris_[at]);
        if (ratio > kPositionHolds) continue;
        if (!best || std::tuple(at, ratio) < std::tuple(best_at, best->ratio)) {
          best = {i, iris_[at], ratio};
          best_at = at;
        }
        break;
      }
    }
    return best;
  }

  /// Smallest ratio, then the smallest f-number, then the first position; in the order of what the positions promise,
  /// until none promises more than there is.
  PositionPair Sharpest() {
    std::vector<std::pair<double, std::size_t>> order;
    for (const std::size_t i : focus_) {
      Ask(i);
      order.emplace_back(Promise(), i);
    }
    std::ranges::sort(order);
    std::optional<PositionPair> best;
    for (const auto& [promise, i] : order) {
      if (best && promise > best->ratio) break;
      Ask(i);
      for (const std::size_t j : iris_) {
        const double ratio = Worst(j);
        if (!best || std::tuple(ratio, j, i) < std::tuple(best->ratio, best->iris, best->focus)) best = {i, j, ratio};
      }
    }
    return *best;
  }

 private:
  void Ask(std::size_t focus) {
    needs_.clear();
    for (std::size_t k = 0; k < blur_.limits(); ++k) needs_.push_back(blur_.Need(k, lens_.focus[focus]));
  }
  double Worst(std::size_t iris) const {
    double worst = 0.0;
    for (const OpeningNeed& need : needs_) worst = std::max(worst, need.Ratio(n_[iris].first, n_[iris].second));
    return worst;
  }
  double Promise() const {
    double least = 0.0;
    for (const OpeningNeed& need : needs_) {
      least =
          std::max(least, need.sharp ? need.geometric / (need.limit * highest_low_) : need.Ratio(1.0, lowest_high_));
      if (need.sharp) least = std::max(least, std::sqrt(2.0 * need.geometric * need.diffraction) / need.limit);
    }
    return least;
  }

  const LensPositions& lens_;
  const PositionBlur& blur_;
  const std::vector<std::size_t>&focus_, &iris_;
  std::vector<std::pair<double, double>> n_;
  double highest_low_ = 0.0, lowest_high_ = kNoEnd;
  std::vector<OpeningNeed> needs_;
};

}  // namespace

ScannedChoice ScanChoice(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur) {
  ScannedChoice choice;
  const auto& focus = lens.focus;
  std::size_t nearest = 0;
  if (!request.focus) {
    const double low = request.extensions.low.value, high = request.extensions.high.value;
    const double hair = 1e-9 * std::max(std::abs(low), std::abs(high)), middle = 0.5 * (low + high);
    const auto off = [&](std::size_t i) { return std::abs(focus[i].extension.value - middle); };
    for (std::size_t i = 0; i < focus.size(); ++i) {
      const double extension = focus[i].extension.value;
      if (extension >= low - hair && extension <= high + hair) choice.focus.push_back(i);
      if (off(i) < off(nearest)) nearest = i;
    }
    if (choice.focus.empty()) choice.focus = {nearest};
    return choice;
  }
  const auto off = [&](std::size_t i) {
    return std::abs(blur.Vergence(*request.focus, focus[i]) - focus[i].focal_plane.value);
  };
  for (std::size_t i = 1; i < focus.size(); ++i) {
    if (off(i) < off(nearest)) nearest = i;
  }
  choice.focus = {nearest};
  double step = 0.0;
  if (nearest > 0) step = (focus[nearest].focal_plane - focus[nearest - 1].focal_plane).value;
  if (nearest + 1 < focus.size()) {
    step = std::max(step, (focus[nearest + 1].focal_plane - focus[nearest].focal_plane).value);
  }
  choice.focus_reachable =
      off(nearest) <= std::max(0.5001 * step, blur.Bound(focus[nearest], focus[nearest].focal_plane.value));
  return choice;
}

PositionPair ScanPairs(const PlanRequest& request, const LensPositions& lens, const PositionBlur& blur,
                       const std::vector<std::size_t>& focus, const std::vector<std::size_t>& iris) {
  Scan scan(lens, blur, focus, iris);
  if (blur.limits() == 0) return {focus[(focus.size() - 1) / 2], iris.front(), 0.0};
  if (request.objective == Objective::Light) {
    if (const auto brightest = scan.Brightest()) return *brightest;
  }
  return scan.Sharpest();
}

}  // namespace lensd::optics
