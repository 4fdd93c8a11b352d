// A lens out of focus makes an even disk of every point. The sharp picture's spectrum times that of a disk,
// 2 J1(x) / x, is the picture that the disk would make; the disk whose picture resembles the blurred one most is the
// answer. Brightness and its offset drop out of a correlation. What the edges wrap around is left out.
#include "cli/online/pictures/picture_blur.h"

#include <algorithm>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

namespace lensd::cli {
namespace {

using Complex = std::complex<double>;

constexpr int kLargestSide = 128;  ///< px: a plain transform takes the cube of it
constexpr double kAlike = 0.7;     ///< of the scatter that a disk has to explain
constexpr double kCoarse = 1.0;    ///< px, between the diameters of the first look
constexpr double kFine = 0.02;     ///< px, of the answer

/// cos and sin of every multiple of a turn's n-th part.
std::vector<Complex> Turns(int n, double sign) {
  std::vector<Complex> turns;
  for (int k = 0; k < n; ++k) turns.push_back(std::polar(1.0, sign * 2.0 * std::numbers::pi * k / n));
  return turns;
}

/// Transforms `count` lines of `length` values each, `step` apart, that begin `between` apart.
void Lines(std::vector<Complex>& values, int length, int step, int count, int between, double sign) {
  const std::vector<Complex> turns = Turns(length, sign);
  std::vector<Complex> line(static_cast<std::size_t>(length));
  for (int l = 0; l < count; ++l) {
    const auto at = [&](int i) { return static_cast<std::size_t>(l * between + i * step); };
    for (int k = 0; k < length; ++k) {
      double real = 0.0, imaginary = 0.0;  // a product of std::complex looks for infinities each time
      for (int i = 0; i < length; ++i) {
        const Complex value = values[at(i)], turn = turns[static_cast<std::size_t>(i * k % length)];
        real += value.real() * turn.real() - value.imag() * turn.imag();
        imaginary += value.real() * turn.imag() + value.imag() * turn.real();
      }
      line[static_cast<std::size_t>(k)] = {real, imaginary};
    }
    for (int k = 0; k < length; ++k) values[at(k)] = line[static_cast<std::size_t>(k)];
  }
}

void Transform(std::vector<Complex>& values, int width, int height, double sign) {
  Lines(values, width, 1, height, width, sign);
  Lines(values, height, width, width, 1, sign);
}

/// Of a disk of that diameter, at a frequency in cycles a pixel.
double DiskAt(double diameter, double frequency) {
  const double x = std::numbers::pi * diameter * frequency;
  return x < 1e-6 ? 1.0 : 2.0 * boost::math::cyl_bessel_j(1, x) / x;
}

/// Of the frequencies of a line: those above the middle are negative.
double FrequencyOf(int k, int n) {
  return static_cast<double>(k <= n / 2 ? k : k - n) / n;
}

std::vector<double> Middle(const LightPicture& picture, int width, int height) {
  const int left = (picture.width - width) / 2, top = (picture.height - height) / 2;
  std::vector<double> middle;
  for (int y = 0; y < height; ++y) {
    const auto row = picture.light.begin() + (top + y) * picture.width + left;
    middle.insert(middle.end(), row, row + width);
  }
  return middle;
}

/// Squared correlation of both but for a rim.
double Alike(std::span<const Complex> made, std::span<const double> seen, int width, int height, int rim) {
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (int y = rim; y < height - rim; ++y) {
    for (int x = rim; x < width - rim; ++x) {
      const auto at = static_cast<std::size_t>(y * width + x);
      const double m = made[at].real(), s = seen[at];
      n += 1.0;
      a += m;
      b += s;
      aa += m * m;
      bb += s * s;
      ab += m * s;
    }
  }
  const double both = ab - a * b / n, of_made = aa - a * a / n, of_seen = bb - b * b / n;
  return both > 0.0 && of_made > 0.0 && of_seen > 0.0 ? both * both / (of_made * of_seen) : 0.0;
}

}  // namespace

SharpPicture::SharpPicture(const LightPicture& sharp)
    : width_(std::min(sharp.width, kLargestSide)), height_(std::min(sharp.height, kLargestSide)) {
  const std::vector<double> middle = Middle(sharp, width_, height_);
  spectrum_.assign(middle.begin(), middle.end());
  Transform(spectrum_, width_, height_, -1.0);
}

double SharpPicture::largest() const {
  return std::min(width_, height_) / 8.0;
}

std::optional<double> SharpPicture::BlurOf(const LightPicture& blurred) const {
  const std::vector<double> seen = Middle(blurred, width_, height_);
  const int rim = static_cast<int>(std::ceil(largest() / 2.0)) + 2;
  const auto alike = [&](double diameter) {
    std::vector<Complex> made = spectrum_;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        made[static_cast<std::size_t>(y * width_ + x)] *=
            DiskAt(diameter, std::hypot(FrequencyOf(x, width_), FrequencyOf(y, height_)));
      }
    }
    Transform(made, width_, height_, 1.0);
    return Alike(made, seen, width_, height_, rim);
  };
  double best = 0.0, most = 0.0;
  for (double diameter = kCoarse; diameter <= largest(); diameter += kCoarse) {
    const double now = alike(diameter);
    if (now > most) std::tie(best, most) = std::pair(diameter, now);
  }
  if (most < kAlike || best + kCoarse > largest()) return std::nullopt;
  double low = best - kCoarse, high = best + kCoarse;
  while (high - low > kFine) {
    const double third = (high - low) / 3.0;
    if (alike(low + third) < alike(high - third)) {
      low += third;
    } else {
      high -= third;
    }
  }
  return 0.5 * (low + high);
}

}  // namespace lensd::cli
