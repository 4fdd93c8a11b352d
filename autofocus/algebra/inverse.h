// The inverse of a small matrix, for normal equations whose number of terms is known only when they are made.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace lensd::autofocus {

/// The inverse of the first `count` rows and columns of `m`, an array or vector of rows, by Gauss and Jordan with row
/// pivots; the rest is 0. Nothing where it is singular: a pivot is not above `least` times the first element.
template <class Rows>
std::optional<Rows> InverseOf(Rows m, std::size_t count, double least) {
  Rows inverse = m;
  for (auto& row : inverse) {
    for (double& value : row) value = 0.0;
  }
  const double small = least * std::abs(m[0][0]);
  for (std::size_t i = 0; i < count; ++i) inverse[i][i] = 1.0;
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t pivot = i;
    for (std::size_t row = i + 1; row < count; ++row) {
      if (std::abs(m[row][i]) > std::abs(m[pivot][i])) pivot = row;
    }
    if (!(std::abs(m[pivot][i]) > small)) return std::nullopt;
    std::swap(m[i], m[pivot]);
    std::swap(inverse[i], inverse[pivot]);
    const double scale = 1.0 / m[i][i];
    for (std::size_t k = 0; k < count; ++k) m[i][k] *= scale, inverse[i][k] *= scale;
    for (std::size_t row = 0; row < count; ++row) {
      if (row == i) continue;
      const double factor = m[row][i];
      for (std::size_t k = 0; k < count; ++k) m[row][k] -= factor * m[i][k], inverse[row][k] -= factor * inverse[i][k];
    }
  }
  return inverse;
}

}  // namespace lensd::autofocus
