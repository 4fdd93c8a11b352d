// A weighted parabola through the logarithms of the values, or powers of them; all values must be above zero.
#include "autofocus/peak_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "autofocus/algebra/matrix3.h"

namespace lensd::autofocus {
namespace {

double Determinant(const Matrix3& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

Vector3 Times(const Matrix3& m, const Vector3& v) {
  Vector3 product{};
  for (std::size_t i = 0; i < 3; ++i) product[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return product;
}

}  // namespace

/// By cofactors.
std::optional<Matrix3> InverseOfSymmetric(const Matrix3& m) {
  const double determinant = Determinant(m);
  if (!(std::abs(determinant) > 1e-12 * m[0][0] * m[1][1] * m[2][2])) return std::nullopt;
  Matrix3 inverse{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      inverse[i][j] = (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / determinant;
    }
  }
  return inverse;
}

std::optional<PeakFit> FitPeak(std::span<const CurvePoint> points, double power) {
  if (points.size() < 3) return std::nullopt;
  // Positions about the highest point and in units of the spread keep the normal equations well conditioned.
  const CurvePoint& highest = *std::ranges::max_element(points, {}, &CurvePoint::value);
  const double centre = highest.position, height = highest.value;
  const auto [low, high] = std::ranges::minmax_element(points, {}, &CurvePoint::position);
  const double scale = high->position - low->position;
  if (!(scale > 0)) return std::nullopt;

  // y = a + b x + c x², y = (height^-power value^power - 1) / power, which is ln(value/height) at power 0: it has its
  // top where the curve has it. Weight 1/sigma_y².
  const auto bent = [&](double value) {
    const double ln = std::log(value / height);
    return power == 0.0 ? ln : std::expm1(power * ln) / power;
  };
  const auto sigma_of = [&](const CurvePoint& point) {
    return point.sigma / point.value * std::pow(point.value / height, power);
  };
  Matrix3 normal{};
  Vector3 right{};
  for (const CurvePoint& point : points) {
    const double x = (point.position - centre) / scale;
    const double weight = std::pow(sigma_of(point), -2.0);
    const Vector3 basis = {1.0, x, x * x};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) normal[i][j] += weight * basis[i] * basis[j];
      right[i] += weight * basis[i] * bent(point.value);
    }
  }
  const auto covariance = InverseOfSymmetric(normal);
  if (!covariance) return std::nullopt;
  const auto [a, b, c] = Times(*covariance, right);
  if (!(c < 0)) return std::nullopt;

  // Scatter beyond what the points claim for themselves widens the error of the answer.
  double chi_square = 0.0;
  for (const CurvePoint& point : points) {
    const double x = (point.position - centre) / scale;
    const double miss = (bent(point.value) - (a + b * x + c * x * x)) / sigma_of(point);
    chi_square += miss * miss;
  }
  const double spread = points.size() > 3 ? std::max(1.0, chi_square / static_cast<double>(points.size() - 3)) : 1.0;
  // vertex = -b/2c; its derivatives by b and c.
  const double by_b = -0.5 / c;
  const double by_c = 0.5 * b / (c * c);
  const double variance =
      by_b * by_b * (*covariance)[1][1] + 2 * by_b * by_c * (*covariance)[1][2] + by_c * by_c * (*covariance)[2][2];
  const double top = a - 0.25 * b * b / c;
  if (!(1.0 + power * top > 0)) return std::nullopt;
  return PeakFit{.position = centre - 0.5 * b / c * scale,
                 .sigma = std::sqrt(std::max(variance, 0.0) * spread) * scale,
                 .height = height * (power == 0.0 ? std::exp(top) : std::pow(1.0 + power * top, 1.0 / power)),
                 .width = scale / std::sqrt(-2.0 * c)};
}

}  // namespace lensd::autofocus
