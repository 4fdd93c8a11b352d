// How blurred one picture is against another of the same scene.
#pragma once

#include <optional>
#include <vector>

#include "verify/disk_blur.h"

namespace lensd::cli {

/// Linear light, row after row; 1 is the brightest that the camera can show.
struct LightPicture {
  int width = 0;
  int height = 0;
  std::vector<double> light;
  /// Part of the pixels that are as bright as the camera can show, or nearly.
  double Clipped() const;
};

/// The diameter of an even disk of light, px.
struct DiskBetween {
  double px = 0.0;    ///< likeliest
  double low = 0.0;   ///< 95 % interval; 0: the pictures cannot tell the disk from none
  double high = 0.0;  ///< its upper end
};

/// A sharp picture, against which others are held.
class SharpPicture {
 public:
  static constexpr int kSmallest = 32;  ///< px each way
  /// By two or more pictures taken alike, whose mean counts and whose differences tell the noise. All of one size, at
  /// least kSmallest each way; of larger ones than 128 px the middle counts.
  explicit SharpPicture(const std::vector<LightPicture>& alike);
  /// The even disk of light that makes the sharp picture into `blurred`, of the same size and taken by the same light
  /// and exposure. A small change of the light is measured and widens the interval. Nothing: no disk up to `largest()`
  /// explains the picture, every larger one would explain it too, or nothing is to be seen.
  std::optional<DiskBetween> BlurOf(const LightPicture& blurred) const;
  /// The widest blur that is looked for, px.
  double largest() const;

 private:
  class Misfit;
  int width_, height_;
  double noise_;  ///< variance of the mean's pixels
  verify::DiskBlur sharp_;
};

}  // namespace lensd::cli
