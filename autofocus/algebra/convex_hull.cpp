// The point is a mixture of a few of the cloud's. Those are gathered one by one, the one that lies farthest along the
// way to go first, and let go of where the mixture that comes nearest would take less than nothing of them (Wolfe,
// "Finding the nearest point in a polytope", 1976). That ends after finitely many steps, however thin the cloud is.
#include "autofocus/algebra/convex_hull.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace lensd::autofocus {
namespace {

constexpr int kMostSteps = 1000;
constexpr double kSamePoint = 1e-6;  ///< of a coordinate from -1 to 1
constexpr double kNoShare = 1e-13;   ///< of a mixture
constexpr double kNoCloser = 1e-14;  ///< of squares of distances

using Places = std::vector<std::vector<double>>;

double Product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// What solves `rows` times shares = 1, by elimination; empty: they do not hang together enough.
std::vector<double> SolvedForOnes(Places rows) {
  const std::size_t n = rows.size();
  std::vector<double> right(n, 1.0);
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i) {
      if (std::abs(rows[i][k]) > std::abs(rows[pivot][k])) pivot = i;
    }
    if (std::abs(rows[pivot][k]) < 1e-14) return {};
    std::swap(rows[k], rows[pivot]);
    std::swap(right[k], right[pivot]);
    for (std::size_t i = k + 1; i < n; ++i) {
      const double factor = rows[i][k] / rows[k][k];
      for (std::size_t j = k; j < n; ++j) rows[i][j] -= factor * rows[k][j];
      right[i] -= factor * right[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) right[k] -= rows[k][j] * right[j];
    right[k] /= rows[k][k];
  }
  return right;
}

/// A mixture of places, which are seen from the point that it is to come near to.
class Mixture {
 public:
  Mixture(const Places& places, std::size_t first) : places_(places), used_{first}, shares_{1.0} {}

  std::vector<double> Point() const {
    std::vector<double> point(places_[0].size());
    for (std::size_t k = 0; k < used_.size(); ++k) {
      for (std::size_t i = 0; i < point.size(); ++i) point[i] += shares_[k] * places_[used_[k]][i];
    }
    return point;
  }
  bool Uses(std::size_t place) const { return std::ranges::find(used_, place) != used_.end(); }

  /// Takes one more, and comes as near as it can. False: it cannot be told any better.
  bool Take(std::size_t place) {
    used_.push_back(place);
    shares_.push_back(0.0);
    while (true) {
      const std::vector<double> wanted = NearestOfTheirPlane();
      if (wanted.empty()) return false;
      if (std::ranges::all_of(wanted, [](double share) { return share > kNoShare; })) {
        shares_ = wanted;
        return true;
      }
      LetGo(wanted);
    }
  }

 private:
  /// The shares, which add up to 1 and may be below 0, of the point of their plane that comes nearest.
  std::vector<double> NearestOfTheirPlane() const {
    Places products;
    for (const std::size_t one : used_) {
      std::vector<double>& row = products.emplace_back();
      for (const std::size_t other : used_) row.push_back(1.0 + Product(places_[one], places_[other]));
    }
    std::vector<double> shares = SolvedForOnes(std::move(products));
    double sum = 0.0;
    for (const double share : shares) sum += share;
    for (double& share : shares) share /= sum;
    return shares;
  }

  /// Goes towards `wanted` as far as no share falls below 0, and drops what has none left.
  void LetGo(const std::vector<double>& wanted) {
    double part = std::numeric_limits<double>::infinity();
    std::size_t first = 0;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      if (wanted[k] > kNoShare) continue;
      const double reach = shares_[k] > wanted[k] ? shares_[k] / (shares_[k] - wanted[k]) : 0.0;
      if (reach < part) part = reach, first = k;
    }
    part = std::min(part, 1.0);
    double sum = 0.0;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      shares_[k] = k == first ? 0.0 : shares_[k] + part * (wanted[k] - shares_[k]);
      if (shares_[k] <= kNoShare) shares_[k] = 0.0;
      sum += shares_[k];
    }
    for (std::size_t k = wanted.size(); k-- > 0;) {
      shares_[k] /= sum;
      if (shares_[k] > 0.0) continue;
      shares_.erase(shares_.begin() + static_cast<std::ptrdiff_t>(k));
      used_.erase(used_.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }

  const Places& places_;
  std::vector<std::size_t> used_;
  std::vector<double> shares_;
};

}  // namespace

std::vector<double> NearestBetween(const Places& points, const std::vector<double>& at) {
  Places seen = points;
  for (std::vector<double>& place : seen) {
    for (std::size_t i = 0; i < at.size(); ++i) place[i] -= at[i];
  }
  const auto farthest_against = [&](const std::vector<double>& way) {
    return static_cast<std::size_t>(
        std::ranges::min_element(seen, {}, [&](const auto& place) { return Product(place, way); }) - seen.begin());
  };
  const auto squares = [](const auto& place) { return Product(place, place); };
  Mixture mixture(seen, static_cast<std::size_t>(std::ranges::min_element(seen, {}, squares) - seen.begin()));
  std::vector<double> here = mixture.Point();
  for (int step = 0; step < kMostSteps; ++step) {
    if (Product(here, here) <= kSamePoint * kSamePoint) return at;
    const std::size_t next = farthest_against(here);
    if (Product(seen[next], here) >= Product(here, here) - kNoCloser || mixture.Uses(next)) break;
    if (!mixture.Take(next)) break;
    here = mixture.Point();
  }
  for (std::size_t i = 0; i < at.size(); ++i) here[i] += at[i];
  return here;
}

}  // namespace lensd::autofocus
