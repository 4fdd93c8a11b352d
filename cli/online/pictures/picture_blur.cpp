// A lens out of focus makes an even disk of every point. The sharp picture is blurred by disks of many diameters and
// held against the blurred one. Two things tell the diameter: how much each fineness of detail loses beside the others,
// and, where there is one fineness alone, as in stripes of one period, how much contrast is lost. The second needs the
// light to be equal in both pictures; how equal it is, their mean brightness says.
#include "cli/online/pictures/picture_blur.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <ranges>

namespace lensd::cli {
namespace {

constexpr int kLargestSide = 128;      ///< px: what is looked at
constexpr double kFull = 0.99;         ///< of the brightest: counts as clipped
constexpr double kAlike = 0.7;         ///< of the scatter that a disk has to explain
constexpr double kStep = 0.5;          ///< px, between the diameters of the first look
constexpr double kFine = 0.005;        ///< px, of the answer
constexpr double kLightError = 0.005;  ///< relative standard error of contrast by what mean brightness does not show
constexpr double kDiskMisfit = 0.005;  ///< of the contrast: how well an even disk explains a picture at best
constexpr double kPixelsAsOne = 4.0;   ///< what is left of the pictures is alike in neighbouring pixels
constexpr double kTwoSided = 2.0;      ///< standard deviations: 95 %

/// Weights of a line's pixels, the middle ones most: by them a mean is that of whole periods of stripes, whatever part
/// of a period lies at the ends.
std::vector<double> Bell(int pixels) {
  std::vector<double> bell;
  for (int i = 0; i < pixels; ++i) bell.push_back(1.0 - std::cos(2.0 * std::numbers::pi * (i + 0.5) / pixels));
  return bell;
}

/// The largest part of a picture about its middle that is looked at.
verify::Plane Middle(const LightPicture& picture) {
  verify::Plane middle{std::min(picture.width, kLargestSide), std::min(picture.height, kLargestSide), {}};
  const int left = (picture.width - middle.width) / 2, top = (picture.height - middle.height) / 2;
  for (int y = 0; y < middle.height; ++y) {
    const auto row = picture.light.begin() + static_cast<std::ptrdiff_t>(top + y) * picture.width + left;
    middle.values.insert(middle.values.end(), row, row + middle.width);
  }
  return middle;
}

verify::Plane MeanOf(const std::vector<LightPicture>& alike) {
  verify::Plane mean = Middle(alike.front());
  for (std::size_t i = 1; i < alike.size(); ++i) {
    std::ranges::transform(mean.values, Middle(alike[i]).values, mean.values.begin(), std::plus());
  }
  for (float& value : mean.values) value /= static_cast<float>(alike.size());
  return mean;
}

/// Variance of what two pictures taken alike do not share, in one of them; other light is no noise.
double NoiseOf(const verify::Plane& one, const verify::Plane& other) {
  double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t i = 0; i < one.values.size(); ++i) {
    const double x = one.values[i], y = other.values[i];
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  const auto n = static_cast<double>(one.values.size());
  const double both = ab - a * b / n;
  return std::max(std::sqrt(std::max(aa - a * a / n, 0.0) * std::max(bb - b * b / n, 0.0)) - both, 0.0) / n;
}

double NoiseOfMean(const std::vector<LightPicture>& alike) {
  double sum = 0.0;
  for (std::size_t i = 1; i < alike.size(); ++i) sum += NoiseOf(Middle(alike[i - 1]), Middle(alike[i]));
  const auto pictures = static_cast<double>(alike.size());
  return sum / (pictures - 1.0) / pictures;
}

/// Part of white noise's variance that a disk leaves.
double NoiseAfter(double diameter) {
  constexpr int kParts = 24;  // of the frequencies from 0 to half a cycle a pixel
  double sum = 0.0;
  for (int x = 0; x < kParts; ++x) {
    for (int y = 0; y < kParts; ++y) {
      sum += std::pow(verify::DiskResponse(diameter, std::hypot(x + 0.5, y + 0.5) / (2.0 * kParts)), 2);
    }
  }
  return sum / (kParts * kParts);
}

}  // namespace

double LightPicture::Clipped() const {
  const auto clipped = std::ranges::count_if(light, [](double value) { return value >= kFull; });
  return static_cast<double>(clipped) / static_cast<double>(std::max<std::size_t>(light.size(), 1));
}

/// What is left of a blurred picture when the sharp one, blurred by a disk, is taken from it.
class SharpPicture::Misfit {
 public:
  Misfit(const SharpPicture& sharp, const LightPicture& blurred)
      : sharp_(sharp),
        seen_(Middle(blurred)),
        rim_(static_cast<int>(std::ceil(sharp.largest() / 2.0)) + 2),
        across_(Bell(seen_.width - 2 * rim_)),
        down_(Bell(seen_.height - 2 * rim_)) {}

  /// What counts is the picture but for a rim.
  struct Sums {
    double pixels = 0.0;
    double made_light = 0.0, seen_light = 0.0;  ///< weighed by bells
    /// Squares and product of what is not the mean. The sharp pictures' noise is taken out, or else wider disks would
    /// be favoured for leaving less of it.
    double made = 0.0, seen = 0.0, both = 0.0;

    /// Part of the seen picture's scatter that the made one explains.
    double Alike() const { return both > 0.0 && made > 0.0 && seen > 0.0 ? both * both / (made * seen) : 0.0; }
  };
  Sums At(double diameter) const {
    const verify::Plane made = sharp_.sharp_.Blurred(diameter, {});
    Sums sums;
    double a = 0.0, b = 0.0;
    for (int y = rim_; y < made.height - rim_; ++y) {
      for (int x = rim_; x < made.width - rim_; ++x) {
        const auto at = static_cast<std::size_t>(y * made.width + x);
        const double m = made.values[at], s = seen_.values[at];
        const double weight = across_[static_cast<std::size_t>(x - rim_)] * down_[static_cast<std::size_t>(y - rim_)];
        sums.pixels += 1.0;
        sums.made_light += weight * m;
        sums.seen_light += weight * s;
        a += m;
        b += s;
        sums.made += m * m;
        sums.seen += s * s;
        sums.both += m * s;
      }
    }
    sums.made -= a * a / sums.pixels + sharp_.noise_ * NoiseAfter(diameter) * sums.pixels;
    sums.seen -= b * b / sums.pixels;
    sums.both -= a * b / sums.pixels;
    return sums;
  }

  /// What the best disk of all leaves counts as noise: the sum of its squares.
  void NoiseIs(double left) { noise_ = left; }

  /// Chi-square of a diameter by its sums, with the light's change, which both means tell, as likely as it is.
  double ChiSquare(const Sums& sums) const {
    if (sums.made_light <= 0.0) return INFINITY;
    const double change = sums.seen_light / sums.made_light, error = std::hypot(kLightError, change - 1.0);
    const double noise = kPixelsAsOne * std::max(noise_, kDiskMisfit * kDiskMisfit * sums.seen) / sums.pixels;
    const double weight = noise / (error * error);
    const double gain = std::max((sums.both + weight * change) / (sums.made + weight), 0.0);
    const double left = sums.seen - 2.0 * gain * sums.both + gain * gain * sums.made;
    return left / noise + std::pow((gain - change) / error, 2);
  }
  double ChiSquare(double diameter) const { return ChiSquare(At(diameter)); }

  /// Between `low` and `high`, where the chi-square is least.
  double Least(double low, double high) const {
    while (high - low > kFine) {
      const double third = (high - low) / 3.0;
      if (ChiSquare(low + third) < ChiSquare(high - third)) {
        high -= third;
      } else {
        low += third;
      }
    }
    return 0.5 * (low + high);
  }

  /// Where between a diameter that is likely enough and one that is not the chi-square is `level`.
  double EndBetween(double inside, double outside, double level) const {
    while (std::abs(inside - outside) > kFine) {
      const double middle = 0.5 * (inside + outside);
      (ChiSquare(middle) <= level ? inside : outside) = middle;
    }
    return outside;
  }

 private:
  const SharpPicture& sharp_;
  const verify::Plane seen_;
  const int rim_;
  const std::vector<double> across_, down_;
  double noise_ = 0.0;
};

SharpPicture::SharpPicture(const std::vector<LightPicture>& alike)
    : width_(std::min(alike.front().width, kLargestSide)),
      height_(std::min(alike.front().height, kLargestSide)),
      noise_(NoiseOfMean(alike)),
      sharp_(MeanOf(alike), 0.0, static_cast<int>(std::ceil(largest()))) {}

double SharpPicture::largest() const {
  return std::min(width_, height_) / 8.0;
}

std::optional<DiskBetween> SharpPicture::BlurOf(const LightPicture& blurred) const {
  Misfit misfit(*this, blurred);
  std::vector<Misfit::Sums> row;
  for (double diameter = 0.0; diameter <= largest(); diameter += kStep) row.push_back(misfit.At(diameter));
  // First what the best disk leaves, whatever the light.
  const double alike = std::ranges::max(row | std::views::transform(&Misfit::Sums::Alike));
  if (alike < kAlike) return std::nullopt;
  misfit.NoiseIs((1.0 - alike) * row.front().seen);
  std::vector<double> chi;
  for (const auto& sums : row) chi.push_back(misfit.ChiSquare(sums));
  // Then the likeliest diameter, and the outermost ones on both sides that are likely enough.
  const auto last = chi.size() - 1;
  const auto best = static_cast<std::size_t>(std::ranges::min_element(chi) - chi.begin());
  const auto at = [](std::size_t step) { return kStep * static_cast<double>(step); };
  DiskBetween disk;
  disk.px = misfit.Least(at(best > 0 ? best - 1 : 0), at(std::min(best + 1, last)));
  const double level = misfit.ChiSquare(disk.px) + kTwoSided * kTwoSided;
  const auto likely = [level](double value) { return value <= level; };
  const auto lowest = static_cast<std::size_t>(std::ranges::find_if(chi, likely) - chi.begin());
  if (chi.back() <= level) return std::nullopt;
  std::size_t highest = last;
  while (highest > 0 && !likely(chi[highest])) --highest;
  const bool between = lowest > last;  // none of the row is likely enough: all of the interval lies between two of it
  const double first = between ? disk.px : std::min(at(lowest), disk.px);
  const double final = between ? disk.px : std::max(at(highest), disk.px);
  if (first > 0.0) disk.low = misfit.EndBetween(first, std::max(first - kStep, 0.0), level);
  disk.high = misfit.EndBetween(final, std::min(final + kStep, largest()), level);
  return disk;
}

}  // namespace lensd::cli
