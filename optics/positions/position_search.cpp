// The best pair of positions. A position of focus is fixed, so each limit asks one thing of the f-number there: at
// least so much (sharp), at most so much (blurred), or with diffraction to lie in a stretch. Blocks of positions ask no
// less than block_blur.cpp says, so that only those that may hold the best are looked into; the answer is that of
// trying every position. Of very many limits those that decide are found by solving for a few and adding what the
// answer breaks.
#include "optics/positions/position_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "optics/planner/deepest_field.h"
#include "optics/positions/focus_queue.h"

namespace lensd::optics {

namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr double kRoundedDown = 1.0 - 1e-12;  ///< never above the same in another order of operations

class PositionSearch {
 public:
  PositionSearch(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                 const PositionBlur& blur, const PositionChoice& choice)
      : request_(request), lens_(lens), blocks_(blocks), blur_(blur), choice_(choice) {
    n_.reserve(lens_.iris.size());
    for (const IrisPosition& position : lens_.iris) n_.push_back(blur_.FNumbers(position));
    for (const std::size_t j : choice_.iris) {
      highest_low_ = std::max(highest_low_, n_[j].first);
      lowest_high_ = std::min(lowest_high_, n_[j].second);
      spread_ = std::min(spread_, n_[j].second / n_[j].first);
    }
  }

  /// The best point that holds; else the one that comes closest, whose ratio is above 1.
  PositionPair Best() {
    if (blur_.limits() == 0) return Best({});
    std::vector<std::size_t> deciding = FirstLimits();
    for (;;) {
      PositionPair point = Best(deciding);
      const double known = point.ratio;
      std::vector<std::pair<double, std::size_t>> beyond;
      for (std::size_t k = 0; k < blur_.limits(); ++k) {
        const double ratio = RatioOf(blur_.Need(k, lens_.focus[point.focus]), point.iris);
        point.ratio = std::max(point.ratio, ratio);
        if (ratio > known * kPositionHolds) beyond.emplace_back(ratio, k);
      }
      if (beyond.empty()) return point;
      std::ranges::sort(beyond, std::greater<>());
      if (beyond.size() > kAddAtOnce) beyond.resize(kAddAtOnce);
      for (const auto& [ratio, k] : beyond) deciding.push_back(k);
    }
  }

 private:
  static constexpr std::size_t kFew = 16, kAddAtOnce = 16, kSamples = 33;

  /// All of a few; of many those that are worst somewhere.
  std::vector<std::size_t> FirstLimits() const {
    std::vector<std::size_t> first;
    const std::size_t count = blur_.limits();
    if (count <= kFew) {
      for (std::size_t k = 0; k < count; ++k) first.push_back(k);
      return first;
    }
    for (std::size_t sample = 0; sample < kSamples; ++sample) {
      const FocusPosition& position = lens_.focus[choice_.focus[sample * (choice_.focus.size() - 1) / (kSamples - 1)]];
      std::size_t sharpest = 0, softest = 0;
      double most = -1.0, least = kUnlimited;
      for (std::size_t k = 0; k < count; ++k) {
        const OpeningNeed need = blur_.Need(k, position);
        const double n = need.geometric / need.limit;
        if (need.sharp && n > most) most = n, sharpest = k;
        if (!need.sharp && n < least) least = n, softest = k;
      }
      if (most >= 0.0) first.push_back(sharpest);
      if (least < kUnlimited) first.push_back(softest);
    }
    std::ranges::sort(first);
    first.erase(std::unique(first.begin(), first.end()), first.end());
    return first;
  }

  double RatioOf(const OpeningNeed& need, std::size_t iris) const {
    return need.Ratio(n_[iris].first, n_[iris].second);
  }
  /// Of the needs.
  double WorstRatio(std::size_t iris) const {
    double worst = 0.0;
    for (const OpeningNeed& need : needs_) worst = std::max(worst, RatioOf(need, iris));
    return worst;
  }
  void TakeNeeds(const std::vector<std::size_t>& limits, std::size_t focus) {
    needs_.clear();
    for (const std::size_t k : limits) needs_.push_back(blur_.Need(k, lens_.focus[focus]));
  }
  void TakeLeastNeeds(const std::vector<std::size_t>& limits, const FocusRange& block) {
    needs_.clear();
    for (const std::size_t k : limits) needs_.push_back(blur_.LeastNeed(k, block));
  }

  PositionPair Best(const std::vector<std::size_t>& limits) {
    if (request_.objective == Objective::Depth) return Deepest(limits);
    if (limits.empty()) return {choice_.focus[(choice_.focus.size() - 1) / 2], choice_.iris.front(), 0.0};
    if (request_.objective == Objective::Light) {
      if (const auto brightest = Brightest(limits)) return *brightest;
    }
    return Sharpest(limits);
  }

  /// Of the needs: the first f-number that holds, as an index in choice_.iris, and the worst ratio there. Needs that
  /// are no greater give no greater key.
  std::optional<FocusKey> FirstToHold() const {
    double least = 0.0, most = kUnlimited;
    for (const OpeningNeed& need : needs_) {
      double& bound = need.sharp ? least : most;
      const double n = need.geometric / need.limit;
      bound = need.sharp ? std::max(bound, n) : std::min(bound, n);
    }
    if (most * kPositionHolds < lowest_high_ || least > highest_low_ * kPositionHolds) return std::nullopt;
    const auto n_of = [&](std::size_t j) { return lens_.iris[j].f_number.value; };
    const auto from = std::ranges::lower_bound(choice_.iris, least / kPositionHolds, {}, n_of);
    for (auto at = from; at != choice_.iris.end() && !(n_of(*at) > most * kPositionHolds); ++at) {
      const double ratio = WorstRatio(*at);
      if (!(ratio > kPositionHolds)) return FocusKey{static_cast<double>(at - choice_.iris.begin()), ratio};
    }
    return std::nullopt;
  }

  /// Smallest f-number that holds; there the least ratio, then the smallest extension.
  std::optional<PositionPair> Brightest(const std::vector<std::size_t>& limits) {
    FocusQueue queue(
        blocks_, choice_.focus,
        [&](const FocusRange& block) {
          TakeLeastNeeds(limits, block);
          return FirstToHold();
        },
        [&](std::size_t position) {
          TakeNeeds(limits, position);
          return FirstToHold();
        });
    const auto first = queue.Next();
    if (!first) return std::nullopt;
    return PositionPair{first->position, choice_.iris[static_cast<std::size_t>(first->key.first)], first->key.second};
  }

  /// No f-number makes it less at this position.
  double LeastRatio() const {
    double least = 0.0;
    for (const OpeningNeed& need : needs_) {
      const double widest = need.sharp ? need.geometric / (need.limit * highest_low_) : need.Ratio(1.0, lowest_high_);
      const double turn = need.sharp ? std::sqrt(2.0 * need.geometric * need.diffraction) / need.limit : 0.0;
      least = std::max({least, widest, turn});
    }
    return least;
  }

  /// Of the needs: the greatest geometric blur over its limit that is to be sharp, at f/1, and the greatest limit over
  /// the blur there of what is to be blurred.
  std::pair<double, double> AtFOne() const {
    double sharp = 0.0, blurred = 0.0;
    for (const OpeningNeed& need : needs_) {
      if (need.sharp) {
        sharp = std::max(sharp, need.geometric / need.limit);
      } else {
        blurred = std::max(blurred, need.limit / need.geometric);
      }
    }
    return {sharp, blurred};
  }

  /// LeastRatio(), where a sharp limit and a blurred one do not ask for openings that are apart: else any f-number
  /// breaks one of them by as much as the best one between them breaks both.
  std::optional<FocusKey> LeastRatioKey() const {
    const auto [sharp, blurred] = AtFOne();
    const double both = std::min(std::sqrt(sharp * blurred * spread_), kMostBlurRatio) * kRoundedDown;
    return FocusKey{std::max(LeastRatio(), both), 0.0};
  }

  /// Smallest ratio, then the smallest f-number, then the smallest extension.
  PositionPair Sharpest(const std::vector<std::size_t>& limits) {
    FocusQueue queue(
        blocks_, choice_.focus,
        [&](const FocusRange& block) {
          TakeLeastNeeds(limits, block);
          return LeastRatioKey();
        },
        [&](std::size_t position) {
          TakeNeeds(limits, position);
          return LeastRatioKey();
        });
    std::optional<PositionPair> best;
    while (const auto next = queue.Next(best ? best->ratio : kUnlimited)) {
      const std::size_t i = next->position;
      TakeNeeds(limits, i);
      const auto [sharp, blurred] = AtFOne();
      for (const std::size_t j : choice_.iris) {
        const double least = std::max(sharp / n_[j].first, std::min(blurred * n_[j].second, kMostBlurRatio));
        if (best && least * kRoundedDown > best->ratio) continue;
        const PositionPair point{i, j, WorstRatio(j)};
        if (!best || std::tuple(point.ratio, j, i) < std::tuple(best->ratio, best->iris, best->focus)) best = point;
      }
    }
    return *best;
  }

  /// At the fixed focus: of the f-numbers that hold, the one with the greatest depth of field, then the smallest.
  PositionPair Deepest(const std::vector<std::size_t>& limits) {
    const std::size_t i = choice_.focus.front();
    TakeNeeds(limits, i);
    std::optional<PositionPair> best, nearest;
    double deepest = -1.0;
    for (const std::size_t j : choice_.iris) {
      const PositionPair point{i, j, WorstRatio(j)};
      if (!nearest || point.ratio < nearest->ratio) nearest = point;
      const PlanRequest there = blur_.AtPosition(lens_.focus[i], lens_.iris[j], PositionBlur::Limits::LeftOut);
      const FieldDepth field = FieldDepthAt(there, there.f_numbers.low.value, there.extensions.low.value);
      if (point.ratio > kPositionHolds || field.near < field.far || field.near - field.far <= deepest) continue;
      deepest = field.near - field.far;
      best = point;
    }
    if (best) return *best;
    nearest->ratio = std::max(nearest->ratio, std::nextafter(kPositionHolds, 2.0));
    return *nearest;
  }

  const PlanRequest& request_;
  const LensPositions& lens_;
  const FocusBlocks& blocks_;
  const PositionBlur& blur_;
  const PositionChoice& choice_;
  std::vector<std::pair<double, double>> n_;  ///< of each position of the iris
  double highest_low_ = 0.0, lowest_high_ = kUnlimited;
  double spread_ = kUnlimited;  ///< the least ratio of the ends of a position of the iris
  std::vector<OpeningNeed> needs_;
};

}  // namespace

PositionPair BestPair(const PlanRequest& request, const LensPositions& lens, const FocusBlocks& blocks,
                      const PositionBlur& blur, const PositionChoice& choice) {
  return PositionSearch(request, lens, blocks, blur, choice).Best();
}

}  // namespace lensd::optics
