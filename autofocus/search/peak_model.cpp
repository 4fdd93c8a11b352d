// Least squares by Levenberg and Marquardt for a shape that is held, and a search over the shapes. Everything is in
// units of a first parabola's height and width, so the constants fit every lens.
#include "autofocus/peak_model.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "autofocus/algebra/matrix3.h"

namespace lensd::autofocus {
namespace {

constexpr double kLowestPower = -4.0, kHighestPower = 2.0;  ///< of the family that is searched
constexpr double kRejected = 0.95;
constexpr double kNotLevel = 1.0 - 1e-4;
constexpr double kNotNoise = 1.0 - 1e-4;
constexpr double kSmallScatter = 0.05;  ///< of the height: what a wrong shape may leave where there is little noise

/// Positions about the top in units of the width, values in units of the height: all numbers are about 1.
struct Point {
  double x = 0.0, y = 0.0, weight = 0.0;
};

/// Height A, place m and curvature k = 1/(2 w^2).
struct Shape {
  double height = 1.0, place = 0.0, curvature = 0.5;
};

struct Value {
  double y = 0.0;
  Vector3 slopes{};  ///< by height, place and curvature
};

Value At(const Shape& shape, double power, double x) {
  const double off = x - shape.place;
  const double q = shape.curvature * off * off;
  double form = 0.0, by_q = 0.0;
  if (std::abs(power) < 1e-6) {
    form = std::exp(-q);
    by_q = -form;
  } else if (power == 1.0) {
    form = 1.0 - q;
    by_q = -1.0;
  } else if (const double base = 1.0 - power * q; base > 0.0) {
    form = std::pow(base, 1.0 / power);
    by_q = -form / base;
  }
  return {shape.height * form,
          {form, shape.height * by_q * -2.0 * shape.curvature * off, shape.height * by_q * off * off}};
}

double Residual2(std::span<const Point> points, const Shape& shape, double power) {
  double sum = 0.0;
  for (const Point& point : points) {
    const double miss = point.y - At(shape, power, point.x).y;
    sum += point.weight * miss * miss;
  }
  return sum;
}

struct Normal {
  Matrix3 matrix{};
  Vector3 right{};
};

Normal NormalEquations(std::span<const Point> points, const Shape& shape, double power) {
  Normal normal;
  for (const Point& point : points) {
    const Value value = At(shape, power, point.x);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) normal.matrix[i][j] += point.weight * value.slopes[i] * value.slopes[j];
      normal.right[i] += point.weight * value.slopes[i] * (point.y - value.y);
    }
  }
  return normal;
}

struct Fitted {
  Shape shape;
  double residual2 = std::numeric_limits<double>::infinity();
  double place_variance = 0.0;
};

/// Levenberg-Marquardt on the three parameters, the power held.
Fitted FitShape(std::span<const Point> points, double power, Shape shape) {
  constexpr int kMostSteps = 60;
  Fitted best{shape, Residual2(points, shape, power), 0.0};
  double damping = 1e-3;
  for (int step = 0; step < kMostSteps && damping < 1e9; ++step) {
    Normal normal = NormalEquations(points, best.shape, power);
    for (std::size_t i = 0; i < 3; ++i) normal.matrix[i][i] *= 1.0 + damping;
    const auto inverse = InverseOfSymmetric(normal.matrix);
    if (!inverse) break;
    Vector3 change{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) change[i] += (*inverse)[i][j] * normal.right[j];
    }
    const Shape next{best.shape.height + change[0], best.shape.place + change[1], best.shape.curvature + change[2]};
    const double residual2 = Residual2(points, next, power);
    if (!(residual2 <= best.residual2)) {
      damping *= 10.0;
      continue;
    }
    const bool settled = best.residual2 - residual2 <= 1e-12 * best.residual2;
    best.shape = next;
    best.residual2 = residual2;
    damping = std::max(damping / 10.0, 1e-12);
    if (settled) break;
  }
  const auto covariance = InverseOfSymmetric(NormalEquations(points, best.shape, power).matrix);
  if (covariance) best.place_variance = (*covariance)[1][1];
  if (!covariance || !(best.shape.curvature > 0) || !(best.shape.height > 0)) {
    best.residual2 = std::numeric_limits<double>::infinity();
  }
  return best;
}

constexpr double PowerOf(PeakModel model) {
  return model == PeakModel::Parabola ? 1.0 : model == PeakModel::Gaussian ? 0.0 : -1.0;
}

/// The least residual over the family.
double LeastOverPowers(std::span<const Point> points, const Fitted& start) {
  constexpr int kBits = 12;  // what a quantile resolves
  const auto residual2 = [&](double power) {
    const double found = FitShape(points, power, start.shape).residual2;
    return std::isfinite(found) ? found : std::numeric_limits<double>::max();
  };
  const double found = boost::math::tools::brent_find_minima(residual2, kLowestPower, kHighestPower, kBits).second;
  return std::min(found, start.residual2);
}

/// Weighted sum of squares about the weighted mean.
double LevelResidual2(std::span<const Point> points) {
  double weights = 0.0, sum = 0.0, squares = 0.0;
  for (const Point& point : points) {
    weights += point.weight;
    sum += point.weight * point.y;
    squares += point.weight * point.y * point.y;
  }
  return squares - sum * sum / weights;
}

double ChiSquareQuantile(double freedom, double probability) {
  return boost::math::quantile(boost::math::chi_squared(freedom), probability);
}

/// Points in the units of a first fit; the error of a position counts by the slope there.
std::vector<Point> Scaled(std::span<const CurvePoint> points, const PeakFit& first) {
  std::vector<Point> scaled;
  for (const CurvePoint& point : points) {
    const double x = (point.position - first.position) / first.width;
    const double slope = x * std::exp(-0.5 * x * x);
    const double sigma = std::hypot(point.sigma / first.height, slope * point.position_sigma / first.width);
    scaled.push_back({x, point.value / first.height, 1.0 / (sigma * sigma)});
  }
  return scaled;
}

/// What remains beside the peak that noise does not explain.
double RootMeanScatter(std::span<const Point> points, const Fitted& fit, double power) {
  double sum = 0.0;
  for (const Point& point : points) sum += std::pow(point.y - At(fit.shape, power, point.x).y, 2);
  return std::sqrt(sum / static_cast<double>(points.size())) / fit.shape.height;
}

}  // namespace

std::string_view PeakModelName(PeakModel model) {
  constexpr std::string_view kNames[] = {"parabola", "Gaussian", "hyperbola"};
  return kNames[static_cast<std::size_t>(model)];
}

std::expected<PeakChoice, std::string> ChoosePeak(std::span<const CurvePoint> points) {
  const auto refuse = [](const char* why) { return std::unexpected(std::string(why)); };
  if (points.size() < 3) return refuse("fewer than three frames show the peak");
  const auto first = FitPeak(points);
  if (!first) return refuse("the sharpest frames do not form a peak");
  const std::vector<Point> scaled = Scaled(points, *first);
  const double n = static_cast<double>(points.size());

  std::array<Fitted, kPeakModels.size()> fitted;
  PeakChoice choice;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kPeakModels.size(); ++i) {
    fitted[i] = FitShape(scaled, PowerOf(kPeakModels[i]), {});
    ModelFit& fit = choice.fits[i];
    fit.converged = std::isfinite(fitted[i].residual2);
    fit.position = first->position + fitted[i].shape.place * first->width;
    fit.sigma = std::sqrt(fitted[i].place_variance) * first->width;
    fit.height = fitted[i].shape.height * first->height;
    fit.residual2 = fitted[i].residual2;
    least = std::min(least, fit.residual2);
  }
  if (!std::isfinite(least)) return refuse("the sharpest frames do not form a peak");
  if (LevelResidual2(scaled) - least < ChiSquareQuantile(2.0, kNotLevel)) {
    return refuse("noise alone explains the sharpest frames");
  }

  const auto best = static_cast<std::size_t>(std::ranges::min_element(fitted, {}, &Fitted::residual2) - fitted.begin());
  // Each shape against the family; what is left to rounding differs by nothing.
  const double freedom = n - 4.0;
  choice.f_limit = std::numeric_limits<double>::infinity();
  if (freedom >= 1.0) {
    choice.f_limit = boost::math::quantile(boost::math::fisher_f(1.0, freedom), kRejected);
    const double family = std::max(LeastOverPowers(scaled, fitted[best]), 1e-12 * LevelResidual2(scaled));
    for (ModelFit& fit : choice.fits) {
      fit.f = std::max(fit.residual2 - family, 0.0) / (family / freedom);
      fit.rejected = fit.f > choice.f_limit;
    }
  }
  const ModelFit& chosen = choice.fits[best];
  choice.model = kPeakModels[best];
  choice.position = chosen.position;

  // Residuals against the measured noise: more than it explains must at least be small beside the peak.
  const double spare = n - 3.0;
  const bool noise_explains = spare < 1.0 || chosen.residual2 <= ChiSquareQuantile(spare, kNotNoise);
  if (!noise_explains && RootMeanScatter(scaled, fitted[best], PowerOf(choice.model)) > kSmallScatter) {
    return refuse("the sharpest frames scatter about every peak shape by more than their noise");
  }
  const auto [low, high] = std::ranges::minmax(points, {}, &CurvePoint::position);
  if (chosen.position < low.position || chosen.position > high.position) {
    return refuse("the peak would lie outside of the frames that show it");
  }
  const double scatter = spare >= 1.0 ? std::max(1.0, chosen.residual2 / spare) : 1.0;
  double between = 0.0;
  for (const ModelFit& other : choice.fits) {
    if (other.converged && !other.rejected) between = std::max(between, std::abs(other.position - chosen.position));
  }
  choice.sigma = std::hypot(chosen.sigma * std::sqrt(scatter), between);
  return choice;
}

}  // namespace lensd::autofocus
