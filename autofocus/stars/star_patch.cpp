// A plane through most of the pixels is the background; what lies below it tells the noise, as stars lie above.
#include "autofocus/stars/star_patch.h"

#include <algorithm>
#include <cmath>

#include "autofocus/algebra/matrix3.h"

namespace lensd::autofocus {
namespace {

constexpr int kGrownPx = 48;

/// Takes the plane away that most pixels lie on; what is left below it tells the noise.
void TakeBackground(Patch& patch, double least_noise) {
  constexpr int kRounds = 5;
  constexpr double kKept = 2.0;  // standard deviations
  Vector3 plane{MedianOf(patch.light), 0.0, 0.0};
  const double across = 2.0 / patch.width, down = 2.0 / patch.height;
  const auto terms = [&](int column, int row) { return Vector3{1.0, column * across - 1.0, row * down - 1.0}; };
  const auto level = [&](const Vector3& at) { return plane[0] * at[0] + plane[1] * at[1] + plane[2] * at[2]; };
  for (int round = 0; round <= kRounds; ++round) {
    std::vector<double> below;
    for (int row = 0; row < patch.height; ++row) {
      for (int column = 0; column < patch.width; ++column) {
        const double off = patch.At(column, row) - level(terms(column, row));
        if (off <= 0.0) below.push_back(-off);
      }
    }
    patch.noise = std::max(below.empty() ? 0.0 : 1.4826 * MedianOf(std::move(below)), least_noise);
    if (round == kRounds) break;
    Matrix3 matrix{};
    Vector3 right{};
    for (int row = 0; row < patch.height; ++row) {
      for (int column = 0; column < patch.width; ++column) {
        const Vector3 at = terms(column, row);
        const double value = patch.At(column, row);
        if (std::abs(value - level(at)) > kKept * patch.noise) continue;
        for (std::size_t i = 0; i < 3; ++i) {
          for (std::size_t j = 0; j < 3; ++j) matrix[i][j] += at[i] * at[j];
          right[i] += at[i] * value;
        }
      }
    }
    const auto inverse = InverseOfSymmetric(matrix);
    if (!inverse) break;
    for (std::size_t i = 0; i < 3; ++i) {
      plane[i] = (*inverse)[i][0] * right[0] + (*inverse)[i][1] * right[1] + (*inverse)[i][2] * right[2];
    }
  }
  for (int row = 0; row < patch.height; ++row) {
    for (int column = 0; column < patch.width; ++column) {
      patch.light[patch.Index(column, row)] -= level(terms(column, row));
    }
  }
}

}  // namespace

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

Patch PatchOf(const drivers::Frame& frame, const Window& window) {
  Patch patch;
  patch.x = std::max(0, window.x - kGrownPx);
  patch.y = std::max(0, window.y - kGrownPx);
  patch.width = std::min(frame.width, window.x + window.width + kGrownPx) - patch.x;
  patch.height = std::min(frame.height, window.y + window.height + kGrownPx) - patch.y;
  const double full = std::pow(2.0, frame.bits) - 1.0;
  for (int row = 0; row < patch.height; ++row) {
    for (int column = 0; column < patch.width; ++column) {
      const auto at = static_cast<std::size_t>(patch.y + row) * static_cast<std::size_t>(frame.width) +
                      static_cast<std::size_t>(patch.x + column);
      const double sample = (*frame.samples)[at] / full;
      patch.light.push_back(frame.gamma == 1.0 ? sample : std::pow(sample, frame.gamma));
      patch.full.push_back(sample >= 1.0 ? 1 : 0);
    }
  }
  TakeBackground(patch, 1.0 / (std::sqrt(12.0) * full));
  return patch;
}

}  // namespace lensd::autofocus
