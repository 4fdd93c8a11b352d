// Unknown places from the known ones around: means over squares of 2, 4, 8 ... pixels, the smallest that has any.
#include <cmath>

#include "smooth.h"

namespace lensd::merge {
namespace {

struct Level {
  int width = 0, height = 0;
  Plane sum, weight;
};

Level Halved(const Level& fine) {
  Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}, {}};
  coarse.sum.resize(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height));
  coarse.weight.resize(coarse.sum.size());
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const std::size_t from =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width) + static_cast<std::size_t>(x);
      const std::size_t to =
          static_cast<std::size_t>(y / 2) * static_cast<std::size_t>(coarse.width) + static_cast<std::size_t>(x / 2);
      coarse.sum[to] += fine.sum[from];
      coarse.weight[to] += fine.weight[from];
    }
  }
  // What is known well inside a hole must not drown what is known beside it: a weight counts up to a pixel's.
  for (std::size_t i = 0; i < coarse.weight.size(); ++i) {
    if (coarse.weight[i] <= 1.0f) continue;
    coarse.sum[i] /= coarse.weight[i];
    coarse.weight[i] = 1.0f;
  }
  return coarse;
}

/// Between the middles of the coarse squares, linear.
float CoarseAt(const Level& coarse, const Plane& filled, int x, int y) {
  const float u = 0.5f * static_cast<float>(x) - 0.25f, v = 0.5f * static_cast<float>(y) - 0.25f;
  const auto clamped = [](int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; };
  const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
  const float right = u - static_cast<float>(left), down = v - static_cast<float>(top);
  const auto value = [&](int i, int j) {
    return filled[static_cast<std::size_t>(clamped(j, coarse.height)) * static_cast<std::size_t>(coarse.width) +
                  static_cast<std::size_t>(clamped(i, coarse.width))];
  };
  const float above = value(left, top) * (1.0f - right) + value(left + 1, top) * right;
  const float below = value(left, top + 1) * (1.0f - right) + value(left + 1, top + 1) * right;
  return above * (1.0f - down) + below * down;
}

Plane Filled(const Level& level, float otherwise) {
  Plane filled(level.sum.size(), otherwise);
  if (level.width == 1 && level.height == 1) {
    if (level.weight[0] > 0.0f) filled[0] = level.sum[0] / level.weight[0];
    return filled;
  }
  const Level coarse = Halved(level);
  const Plane around = Filled(coarse, otherwise);
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) + static_cast<std::size_t>(x);
      filled[i] = level.sum[i] + (1.0f - level.weight[i]) * CoarseAt(coarse, around, x, y);
    }
  }
  return filled;
}

}  // namespace

Plane FilledPlaces(const Plane& place, const Plane& sigma, int width, int height, float otherwise) {
  Level finest{width, height, place, Plane(place.size())};
  for (std::size_t i = 0; i < place.size(); ++i) {
    const bool known = !std::isnan(place[i]) && !std::isnan(sigma[i]);
    finest.weight[i] = known ? 1.0f : 0.0f;
    if (!known) finest.sum[i] = 0.0f;
  }
  return Filled(finest, otherwise);
}

}  // namespace lensd::merge
