// How blurred one picture is against another of the same scene.
#pragma once

#include <complex>
#include <optional>
#include <vector>

namespace lensd::cli {

/// Linear light, row after row.
struct LightPicture {
  int width = 0;
  int height = 0;
  std::vector<double> light;
};

/// A sharp picture, against which others are held.
class SharpPicture {
 public:
  static constexpr int kSmallest = 32;  ///< px each way
  /// At least kSmallest each way; of a larger one than 128 px the middle counts.
  explicit SharpPicture(const LightPicture& sharp);
  /// Diameter in px of the even disk of light that makes the sharp picture into `blurred`, of the same size, but for
  /// how bright both are. Nothing: no disk up to `largest()` explains it, or nothing is to be seen.
  std::optional<double> BlurOf(const LightPicture& blurred) const;
  /// The widest blur that is looked for, px.
  double largest() const;

 private:
  int width_, height_;
  std::vector<std::complex<double>> spectrum_;
};

}  // namespace lensd::cli
