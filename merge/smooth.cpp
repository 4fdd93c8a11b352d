// A mean over neighbours whose places differ by no more than chance allows: on a slope or a wall that is nearly all of
// them, at the rim of a thing only those of the same side.
#include "smooth.h"

#include <algorithm>
#include <cmath>

namespace lensd::merge {
namespace {

/// Agreeing is within this many steps between frames, and within twice the sigma.
constexpr float kAgreeSteps = 0.5f;
/// A pixel alone among others: the share of its known neighbours that agree with it.
constexpr float kFewestAgree = 0.25f;

}  // namespace

void SmoothPlaces(Plane& place, Plane& sigma, int width, int height, int radius, float step) {
  const Plane from = place, from_sigma = sigma;
  for (int y = 0; y < height; ++y) {
    const int top = std::max(0, y - radius), bottom = std::min(height - 1, y + radius);
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      const float here = from[i];
      if (std::isnan(here)) continue;
      const float reach = kAgreeSteps * step + 2.0f * from_sigma[i], per_square = 1.0f / (reach * reach);
      const int left = std::max(0, x - radius), right = std::min(width - 1, x + radius);
      float sum = 0.0f, weights = 0.0f, known = 0.0f, agree = 0.0f;
      for (int v = top; v <= bottom; ++v) {
        const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
        for (std::size_t k = row + static_cast<std::size_t>(left); k <= row + static_cast<std::size_t>(right); ++k) {
          const float there = from[k];
          if (std::isnan(there)) continue;
          known += 1.0f;
          const float off = (there - here) * (there - here) * per_square;
          if (off >= 1.0f) continue;
          const float weight = (1.0f - off) * (1.0f - off) / (from_sigma[k] * from_sigma[k]);
          agree += 1.0f;
          sum += weight * (there - here);
          weights += weight;
        }
      }
      if (agree < kFewestAgree * known || agree < 3.0f) {
        place[i] = sigma[i] = kUnknown;
        continue;
      }
      place[i] = here + sum / weights;
    }
  }
}

void LeaveRims(Plane& place, Plane& sigma, int width, int height, int radius, float drop) {
  const auto at = [width](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  Plane along(place.size()), smallest(place.size());  // fmin leaves out what is unknown
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float low = place[at(x, y)];
      for (int u = std::max(0, x - radius); u <= std::min(width - 1, x + radius); ++u)
        low = std::fmin(low, place[at(u, y)]);
      along[at(x, y)] = low;
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float low = along[at(x, y)];
      for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v)
        low = std::fmin(low, along[at(x, v)]);
      smallest[at(x, y)] = low;
    }
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] - smallest[i] > drop) place[i] = sigma[i] = kUnknown;
  }
}

}  // namespace lensd::merge
