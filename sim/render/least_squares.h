// The weights that fit wanted values best, each counted as much as it matters.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace lensd::sim {

/// Collects rows "the sum of weight times basis should be wanted" and solves for the weights by normal equations.
class LeastSquares {
 public:
  explicit LeastSquares(std::size_t unknowns) : products_(unknowns * unknowns), wanted_(unknowns) {}

  void Add(const std::vector<double>& basis, double wanted, double importance) {
    const std::size_t n = wanted_.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double share = importance * basis[i];
      wanted_[i] += share * wanted;
      for (std::size_t j = 0; j <= i; ++j) products_[i * n + j] += share * basis[j];
    }
  }

  /// By Cholesky's factors; the rows given so far must tell every unknown from the others.
  std::vector<double> Solve() && {
    const std::size_t n = wanted_.size();
    const auto at = [&](std::size_t i, std::size_t j) -> double& { return products_[i * n + j]; };
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = at(i, j);
        for (std::size_t k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
        at(i, j) = i == j ? std::sqrt(sum) : sum / at(j, j);
      }
      for (std::size_t k = 0; k < i; ++k) wanted_[i] -= at(i, k) * wanted_[k];
      wanted_[i] /= at(i, i);
    }
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t k = i + 1; k < n; ++k) wanted_[i] -= at(k, i) * wanted_[k];
      wanted_[i] /= at(i, i);
    }
    return std::move(wanted_);
  }

 private:
  std::vector<double> products_;  ///< lower triangle
  std::vector<double> wanted_;
};

}  // namespace lensd::sim
