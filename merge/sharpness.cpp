// Fine detail is what a 3 x 3 binomial mean takes away. It is squared, which blur makes smaller whatever the texture,
// and averaged over a window small enough to keep the rims of things and large enough to have some texture in it.
#include "sharpness.h"

#include <algorithm>
#include <cmath>

namespace lensd::merge {
namespace {

constexpr int kWindow = 1;  // radius of each of two means: about five pixels wide

std::size_t At(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

/// (1 2 1)/4 along both axes.
Plane Binomial(const Plane& plane, int width, int height) {
  Plane across(plane.size()), both(plane.size());
  for (int y = 0; y < height; ++y) {
    const float* in = plane.data() + At(0, y, width);
    float* out = across.data() + At(0, y, width);
    for (int x = 1; x + 1 < width; ++x) out[x] = 0.25f * (in[x - 1] + in[x + 1]) + 0.5f * in[x];
    out[0] = 0.75f * in[0] + 0.25f * in[std::min(1, width - 1)];
    out[width - 1] = 0.75f * in[width - 1] + 0.25f * in[std::max(0, width - 2)];
  }
  for (int y = 0; y < height; ++y) {
    const float* above = across.data() + At(0, std::max(0, y - 1), width);
    const float* here = across.data() + At(0, y, width);
    const float* below = across.data() + At(0, std::min(height - 1, y + 1), width);
    float* out = both.data() + At(0, y, width);
    for (int x = 0; x < width; ++x) out[x] = 0.25f * (above[x] + below[x]) + 0.5f * here[x];
  }
  return both;
}

/// Sums of a row over windows that slide along it.
void SlideAlong(const float* in, float* out, int width, int radius) {
  const float part = 1.0f / static_cast<float>(2 * radius + 1);
  double sum = 0.0;
  for (int x = -radius; x <= radius; ++x) sum += static_cast<double>(in[std::clamp(x, 0, width - 1)]);
  for (int x = 0; x < width; ++x) {
    out[x] = static_cast<float>(sum) * part;
    sum += static_cast<double>(in[std::min(x + radius + 1, width - 1)] - in[std::max(x - radius, 0)]);
  }
}

}  // namespace

double MergedScale(const std::vector<Station>& stations) {
  double largest = 0.0;
  for (const Station& station : stations) largest = std::max(largest, station.scale);
  return largest;
}

Plane LuminanceOf(const Picture& picture) {
  if (picture.channels == 1) return picture.samples;
  Plane plane(picture.pixels());
  const float* in = picture.samples.data();
  for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = 0.25f * (in[3 * i] + in[3 * i + 2]) + 0.5f * in[3 * i + 1];
  return plane;
}

double SharedLight(const Plane& luminance, int width, int height, double ratio) {
  const int left = static_cast<int>(0.5 * width * (1.0 - ratio)), top = static_cast<int>(0.5 * height * (1.0 - ratio));
  double sum = 0.0;
  for (int y = top; y < height - top; ++y) {
    float row = 0.0f;
    for (int x = left; x < width - left; ++x) row += luminance[At(x, y, width)];
    sum += static_cast<double>(row);
  }
  return sum / (static_cast<double>(width - 2 * left) * (height - 2 * top));
}

Plane BoxMean(const Plane& plane, int width, int height, int radius) {
  Plane across(plane.size()), both(plane.size());
  for (int y = 0; y < height; ++y) {
    SlideAlong(plane.data() + At(0, y, width), across.data() + At(0, y, width), width, radius);
  }
  const float part = 1.0f / static_cast<float>(2 * radius + 1);
  for (int y = 0; y < height; ++y) {
    float* out = both.data() + At(0, y, width);
    for (int k = -radius; k <= radius; ++k) {
      const float* in = across.data() + At(0, std::clamp(y + k, 0, height - 1), width);
      for (int x = 0; x < width; ++x) out[x] += in[x] * part;
    }
  }
  return both;
}

Sharpness SharpnessOf(const Plane& luminance, int width, int height) {
  Sharpness result;
  result.light = Binomial(luminance, width, height);
  result.detail.resize(luminance.size());
  for (std::size_t i = 0; i < luminance.size(); ++i) {
    const float detail = luminance[i] - result.light[i];
    result.detail[i] = detail * detail;
  }
  result.mean = BoxMean(BoxMean(result.detail, width, height, kWindow), width, height, kWindow);
  return result;
}

Plane Magnified(Plane plane, int width, int height, double ratio) {
  if (ratio == 1.0) return plane;
  std::vector<int> left(static_cast<std::size_t>(width));
  std::vector<float> part(left.size());
  const auto split = [ratio](int x, int size, int& whole, float& rest) {
    const double from = 0.5 * (size - 1) + (x - 0.5 * (size - 1)) * ratio;
    whole = std::clamp(static_cast<int>(std::floor(from)), 0, std::max(0, size - 2));
    rest = static_cast<float>(std::clamp(from - whole, 0.0, size > 1 ? 1.0 : 0.0));
  };
  for (int x = 0; x < width; ++x) split(x, width, left[static_cast<std::size_t>(x)], part[static_cast<std::size_t>(x)]);
  Plane result(plane.size()), row(left.size());
  const int right = width > 1 ? 1 : 0;
  for (int y = 0; y < height; ++y) {
    int top = 0;
    float down = 0.0f;
    split(y, height, top, down);
    const float* above = plane.data() + At(0, top, width);
    const float* below = plane.data() + At(0, std::min(top + 1, height - 1), width);
    for (std::size_t x = 0; x < row.size(); ++x) row[x] = above[x] + down * (below[x] - above[x]);
    float* out = result.data() + At(0, y, width);
    for (std::size_t x = 0; x < row.size(); ++x) {
      const float here = row[static_cast<std::size_t>(left[x])];
      out[x] = here + part[x] * (row[static_cast<std::size_t>(left[x] + right)] - here);
    }
  }
  return result;
}

}  // namespace lensd::merge
