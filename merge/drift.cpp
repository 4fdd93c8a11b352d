// Newton's way: from a first idea, the two pictures are laid over each other, what still differs is explained by small
// changes of size and place as well as it can be, and the idea is corrected; a few times.
#include "merge/drift.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sharpness.h"

namespace lensd::merge {
namespace {

constexpr int kWidth = 600;  // at most
constexpr int kRounds = 4;

struct Small {
  int width = 0, height = 0, factor = 1;
  Plane light;

  float At(double x, double y) const {
    const double u = std::clamp(x, 0.0, width - 1.001), v = std::clamp(y, 0.0, height - 1.001);
    const auto i = static_cast<std::size_t>(u), j = static_cast<std::size_t>(v);
    const auto right = static_cast<float>(u - static_cast<double>(i)),
               down = static_cast<float>(v - static_cast<double>(j));
    const float* at = light.data() + j * static_cast<std::size_t>(width) + i;
    const float above = at[0] + right * (at[1] - at[0]);
    const float below = at[width] + right * (at[width + 1] - at[width]);
    return above + down * (below - above);
  }
};

/// Means of factor x factor pixels, evened over three more: blur and noise matter less there.
Small Reduced(const Picture& picture) {
  const Plane full = LuminanceOf(picture);
  Small small;
  small.factor = std::max(1, (picture.width + kWidth - 1) / kWidth);
  small.width = picture.width / small.factor;
  small.height = picture.height / small.factor;
  small.light.resize(static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.height));
  for (int y = 0; y < small.height * small.factor; ++y) {
    for (int x = 0; x < small.width * small.factor; ++x) {
      small.light[static_cast<std::size_t>(y / small.factor) * static_cast<std::size_t>(small.width) +
                  static_cast<std::size_t>(x / small.factor)] +=
          full[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x)];
    }
  }
  small.light = BoxMean(BoxMean(small.light, small.width, small.height, 1), small.width, small.height, 1);
  return small;
}

constexpr std::size_t kUnknowns = 5;  // growth, right, down, brightness, offset
using Vector = std::array<double, kUnknowns>;
using Matrix = std::array<Vector, kUnknowns>;

/// By elimination; what has no weight stays 0.
Vector Solved(Matrix a, Vector b) {
  constexpr double kNothing = 1e-9;  // of what it was before the others explained their part
  Vector whole{};
  for (std::size_t k = 0; k < kUnknowns; ++k) whole[k] = kNothing * a[k][k];
  for (std::size_t k = 0; k < kUnknowns; ++k) {
    if (a[k][k] <= whole[k]) continue;
    for (std::size_t row = k + 1; row < kUnknowns; ++row) {
      const double factor = a[row][k] / a[k][k];
      for (std::size_t col = k; col < kUnknowns; ++col) a[row][col] -= factor * a[k][col];
      b[row] -= factor * b[k];
    }
  }
  Vector x{};
  for (std::size_t k = kUnknowns; k-- > 0;) {
    if (a[k][k] <= whole[k]) continue;
    double rest = b[k];
    for (std::size_t col = k + 1; col < kUnknowns; ++col) rest -= a[k][col] * x[col];
    x[k] = rest / a[k][k];
  }
  return x;
}

/// One round: what is left of growth and movement when `second` is laid over `first` by `drift`.
Vector Left(const Small& first, const Small& second, const Drift& drift) {
  const double middle_x = 0.5 * (first.width - 1), middle_y = 0.5 * (first.height - 1), factor = first.factor;
  const auto laid = [&](int x, int y) {
    return second.At(middle_x + (x - middle_x) * drift.scale + drift.right_px / factor,
                     middle_y + (y - middle_y) * drift.scale + drift.down_px / factor);
  };
  constexpr int kMargin = 3;
  const int edge = kMargin + static_cast<int>(std::ceil(std::abs(drift.scale - 1.0) * middle_x));
  Matrix a{};
  Vector b{};
  for (int y = edge; y < first.height - edge; ++y) {
    for (int x = edge; x < first.width - edge; ++x) {
      const double right =
          0.25 * static_cast<double>(first.At(x + 1, y) - first.At(x - 1, y) + laid(x + 1, y) - laid(x - 1, y));
      const double down =
          0.25 * static_cast<double>(first.At(x, y + 1) - first.At(x, y - 1) + laid(x, y + 1) - laid(x, y - 1));
      const auto here = static_cast<double>(laid(x, y));
      const Vector change = {(x - middle_x) * right + (y - middle_y) * down, right, down, here, 1.0};
      const double difference = here - static_cast<double>(first.At(x, y));
      for (std::size_t i = 0; i < kUnknowns; ++i) {
        for (std::size_t j = 0; j < kUnknowns; ++j) a[i][j] += change[i] * change[j];
        b[i] += change[i] * difference;
      }
    }
  }
  return Solved(a, b);
}

}  // namespace

Drift MeasureDrift(const Picture& first, const Picture& second, double expected) {
  Drift drift{.scale = expected};
  if (first.width < 32 || first.height < 32) return drift;
  const Small a = Reduced(first), b = Reduced(second);
  for (int round = 0; round < kRounds; ++round) {
    const Vector left = Left(a, b, drift);
    drift.scale *= 1.0 - left[0];
    drift.right_px -= left[1] * a.factor;
    drift.down_px -= left[2] * a.factor;
  }
  return drift;
}

Alignment Align(const std::vector<Drift>& drifts, const std::vector<std::vector<double>>& laws, const Picture& size) {
  constexpr double kFits_px = 1.5;
  const double corner = 0.5 * std::hypot(size.width, size.height);
  Alignment alignment{.scales = {1.0}, .law = std::nullopt};
  for (const Drift& drift : drifts) alignment.scales.push_back(alignment.scales.back() * drift.scale);
  const std::vector<double> measured = alignment.scales;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    const double shift = std::hypot(drifts[i].right_px, drifts[i].down_px);
    if (shift <= alignment.largest_shift_px) continue;
    alignment.largest_shift_px = shift;
    alignment.shifted_after = i;
  }
  for (std::size_t law = 0; law < laws.size(); ++law) {
    double low = 0.0, high = 0.0;  // of how much more the pictures grow than the law says, since the first
    for (std::size_t i = 0; i < measured.size(); ++i) {
      const double more = std::log(measured[i] * laws[law][0] / laws[law][i]);
      low = std::min(low, more);
      high = std::max(high, more);
    }
    const double misfit = (high - low) * corner;
    if (law > 0 && misfit >= alignment.misfit_px) continue;
    alignment.misfit_px = misfit;
    alignment.law = law;
    alignment.scales = laws[law];
  }
  if (alignment.law && alignment.misfit_px <= kFits_px) return alignment;
  alignment.law.reset();
  alignment.scales = measured;
  return alignment;
}

}  // namespace lensd::merge
