// Greedy placement: the labels of the most crowded marks choose first, each the nearest free place around its mark.
#include "bench/report/labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace lensd::bench {
namespace {

constexpr double kGap = 3.0;      ///< px between a mark and its label
constexpr double kCrowd = 60.0;   ///< px within which others count as near
constexpr double kLeader = 14.0;  ///< px from which on a line leads to the label
constexpr std::array kDistances = {0.0, 6.0, 14.0, 24.0, 36.0, 50.0, 70.0, 95.0, 130.0, 170.0, 220.0, 300.0, 400.0};
constexpr int kDirections = 24;

Box MarkBox(const Labelled& mark) {
  return {mark.x - kMarkRadius - 1, mark.y - kMarkRadius - 1, 2 * kMarkRadius + 2, 2 * kMarkRadius + 2};
}

/// The label's box in a direction from the mark, `distance` beyond touching it. Direction 0 is to the right.
Box Candidate(const Labelled& mark, int direction, double distance) {
  const double angle = 2.0 * std::numbers::pi * direction / kDirections;
  const double dx = std::cos(angle), dy = std::sin(angle);
  const double reach_x = kMarkRadius + kGap + 0.5 * mark.width, reach_y = kMarkRadius + 0.5 * mark.height;
  // The box' middle lies on a rounded rectangle around the mark: beside it, above it, or at a corner.
  const double x = mark.x + std::clamp(dx * 1.5, -1.0, 1.0) * reach_x + dx * distance;
  const double y = mark.y + std::clamp(dy * 1.5, -1.0, 1.0) * reach_y + dy * distance;
  return {x - 0.5 * mark.width, y - 0.5 * mark.height, mark.width, mark.height};
}

std::vector<std::size_t> MostCrowdedFirst(const std::vector<Labelled>& marks) {
  std::vector<int> near(marks.size());
  for (std::size_t i = 0; i < marks.size(); ++i) {
    near[i] = static_cast<int>(std::ranges::count_if(
        marks, [&](const Labelled& other) { return std::hypot(other.x - marks[i].x, other.y - marks[i].y) < kCrowd; }));
  }
  std::vector<std::size_t> order(marks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return near[a] > near[b]; });
  return order;
}

}  // namespace

std::optional<std::vector<LabelPlace>> PlaceLabels(const Box& frame, const std::vector<Labelled>& marks,
                                                   const std::vector<Box>& taken) {
  std::vector<Box> blocked = taken;
  for (const Labelled& mark : marks) blocked.push_back(MarkBox(mark));
  std::vector<LabelPlace> places(marks.size());
  for (const std::size_t i : MostCrowdedFirst(marks)) {
    if (marks[i].width <= 0.0) continue;
    bool placed = false;
    for (const double distance : kDistances) {
      for (int direction = 0; direction < kDirections && !placed; ++direction) {
        const Box box = Candidate(marks[i], direction, distance);
        const auto hit = [&](const Box& other) { return Overlap(box, other); };
        if (!Within(box, frame) || std::ranges::any_of(blocked, hit)) continue;
        places[i] = {box, distance >= kLeader};
        blocked.push_back(box);
        placed = true;
      }
      if (placed) break;
    }
    if (!placed) return std::nullopt;
  }
  return places;
}

}  // namespace lensd::bench
