// Symmetric matrices as small as the number of frames taken together, unrolled at compile time.
#pragma once

#include <cmath>

#include "defocus/rings.h"

namespace lensd::autofocus::defocus {

template <int n>
struct Inverse {
  Matrix inverse{};
  double log_determinant = 0.0;
};

constexpr std::size_t Slot(int row, int column) {
  return static_cast<std::size_t>(row * kMostFrames + column);
}

/// Of a positive definite matrix, by Cholesky.
template <int n>
Inverse<n> Invert(const Matrix& matrix) {
  double lower[n][n] = {};
  double diagonal = 1.0;
  for (int j = 0; j < n; ++j) {
    double pivot = matrix[Slot(j, j)];
    for (int k = 0; k < j; ++k) pivot -= lower[j][k] * lower[j][k];
    diagonal *= pivot;
    const double root = 1.0 / std::sqrt(pivot);
    lower[j][j] = root;  // the inverse of the diagonal, as it is needed below
    for (int i = j + 1; i < n; ++i) {
      double value = matrix[Slot(i, j)];
      for (int k = 0; k < j; ++k) value -= lower[i][k] * lower[j][k];
      lower[i][j] = value * root;
    }
  }
  double inverse_lower[n][n] = {};
  for (int j = 0; j < n; ++j) {
    inverse_lower[j][j] = lower[j][j];
    for (int i = j + 1; i < n; ++i) {
      double sum = 0.0;
      for (int k = j; k < i; ++k) sum -= lower[i][k] * inverse_lower[k][j];
      inverse_lower[i][j] = sum * lower[i][i];
    }
  }
  Inverse<n> result;
  result.log_determinant = std::log(diagonal);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int k = i; k < n; ++k) sum += inverse_lower[k][i] * inverse_lower[k][j];
      result.inverse[Slot(i, j)] = result.inverse[Slot(j, i)] = sum;
    }
  }
  return result;
}

template <int n>
Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      double sum = 0.0;
      for (int k = 0; k < n; ++k) sum += a[Slot(i, k)] * b[Slot(k, j)];
      product[Slot(i, j)] = sum;
    }
  }
  return product;
}

template <int n>
double TraceOfProduct(const Matrix& a, const Matrix& b) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) sum += a[Slot(i, j)] * b[Slot(j, i)];
  }
  return sum;
}

template <int n>
double Trace(const Matrix& a) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += a[Slot(i, i)];
  return sum;
}

}  // namespace lensd::autofocus::defocus
