// The point is a mixture of the cloud's. What of it lies farthest along the way to go is exchanged, step by step, for
// what lies nearest (pairwise Frank-Wolfe; Lacoste-Julien and Jaggi, 2015), which ends fast where there are few points.
#include "convex_hull.h"

#include <algorithm>
#include <cmath>

namespace lensd::autofocus {
namespace {

constexpr int kMostSteps = 5000;
constexpr double kSamePoint = 1e-6;  ///< of a coordinate from -1 to 1

double Along(const std::vector<double>& point, const std::vector<double>& way) {
  double sum = 0.0;
  for (std::size_t i = 0; i < way.size(); ++i) sum += point[i] * way[i];
  return sum;
}

}  // namespace

std::vector<double> NearestBetween(const std::vector<std::vector<double>>& points, const std::vector<double>& at) {
  std::vector<double> share(points.size(), 0.0), here = points[0];
  share[0] = 1.0;
  for (int step = 0; step < kMostSteps; ++step) {
    std::vector<double> way(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) way[i] = at[i] - here[i];
    const double far = std::sqrt(Along(way, way));
    if (far <= kSamePoint) return at;
    std::size_t to = 0, from = points.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (Along(points[i], way) > Along(points[to], way)) to = i;
      if (share[i] > 0.0 && (from == points.size() || Along(points[i], way) < Along(points[from], way))) from = i;
    }
    std::vector<double> change(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) change[i] = points[to][i] - points[from][i];
    const double gain = Along(change, way), squares = Along(change, change);
    if (gain <= kSamePoint * kSamePoint * std::max(1.0, far) || squares == 0.0) break;
    const double part = std::min(share[from], gain / squares);
    share[to] += part;
    share[from] = part == share[from] ? 0.0 : share[from] - part;
    for (std::size_t i = 0; i < at.size(); ++i) here[i] += part * change[i];
  }
  return here;
}

}  // namespace lensd::autofocus
