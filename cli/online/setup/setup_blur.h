// How much blur one step of focus makes, as pictures show it: for `lensctl setup`.
#pragma once

#include <string>

#include "cli/online/pictures/picture_blur.h"
#include "cli/online/setup/setup_motion.h"

namespace lensd::cli {

/// What the pictures around a place in focus tell.
struct BlurSlope {
  std::optional<Measured> px_per_step;  ///< growth of the blur's diameter, px a native unit; none: see `why_not`
  double focus = 0.0;                   ///< where it is least, native units
  int pictures = 0;                     ///< out of focus, that it rests on
  std::string why_not;                  ///< empty: it was measured
};

/// Moves the focus of one lens and takes pictures. A failure ends what is measured: the daemon is gone or refused, or
/// Control-C.
class FocusPictures {
 public:
  virtual ~FocusPictures() = default;
  /// Where focus then is, native units.
  virtual std::expected<double, Failure> Go(double position) = 0;
  virtual std::expected<LightPicture, Failure> Look() = 0;
};

/// The positions of focus that are gone to, native units.
struct FocusReach {
  double low = 0.0, high = 0.0;
  double resolution = 1.0;
};

/// Takes pictures at `focus`, where the lens is in focus, and on both sides of it, all reached moving the same way and
/// within `reach`; then goes back to `focus`. No optics are asked for.
std::expected<BlurSlope, Failure> MeasureBlurSlope(FocusPictures& pictures, const FocusReach& reach, double focus);

/// The same by lensd: pictures of `region` (null: the middle), within the middle four fifths of the range of `info` (an
/// AxisInfo).
std::expected<BlurSlope, Failure> MeasureBlurSlope(DaemonClient& link, const std::string& lens,
                                                   const varlink::Json& info, const varlink::Json& region,
                                                   double focus);

/// The positions of the focus as its pictures and a place whose distance is known say, for optics that are told.
struct NominalCurve {
  struct Point {
    double position = 0.0;  ///< native
    Measured extension_mm;
    Measured vergence;  ///< dioptres, from the lens centre
  };
  std::vector<Point> points;  ///< over the whole range of the axis, both ends among them
};

/// What it is made from.
struct CurveFacts {
  double minimum = 0.0, maximum = 0.0;  ///< of the axis, native
  bool near_positive = true;            ///< greater positions are nearer
  double focus = 0.0;                   ///< the position whose distance is known
  double vergence = 0.0;                ///< dioptres there
  double vergence_sigma = 0.0;          ///< how surely focus is on it, dioptres
  double focal_length_mm = 0.0, f_number = 0.0, pixel_um = 0.0;
};
NominalCurve CurveOf(const CurveFacts& facts, const Measured& px_per_step);

}  // namespace lensd::cli
