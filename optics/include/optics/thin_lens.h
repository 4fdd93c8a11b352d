// The lecture's optical systems as formulas over any number: double for lenses that move, exact rationals for what
// people ask on the command line. Pinhole, bare aperture and thin lens: where a point is imaged, how large its blur
// disk is, which part of the scene a sensor point sees, how much light arrives. Lengths in metres, vergences in 1/m.
// Object side and image side share the lens centre as origin and have opposite axes, so that real depths are positive
// on both.
#pragma once

#include <array>
#include <cmath>

namespace lensd::optics::thin_lens {

/// A double with what its rounding left out, correct to about twice double precision. Blur near the plane in focus is a
/// small difference of nearly equal products; rounding those first would leave nothing of it.
class TwoDoubles {
 public:
  TwoDoubles(double value) : value_(value) {}  // NOLINT(*-explicit-*)
  explicit operator double() const { return value_ + rest_; }

  friend TwoDoubles operator*(const TwoDoubles& a, double b) {
    const double product = a.value_ * b;
    return {product, std::fma(a.value_, b, -product) + a.rest_ * b};
  }
  friend TwoDoubles operator-(const TwoDoubles& a, const TwoDoubles& b) {
    const double difference = a.value_ - b.value_;
    const double b_kept = a.value_ - difference;
    const double lost = (a.value_ - (difference + b_kept)) + (b_kept - b.value_);
    return {difference, lost + (a.rest_ - b.rest_)};
  }

 private:
  TwoDoubles(double value, double rest) : value_(value), rest_(rest) {}
  double value_;
  double rest_ = 0.0;
};

/// The type for differences of products: itself where it is exact.
template <class T>
struct WideType {
  using Type = T;
};
template <>
struct WideType<double> {
  using Type = TwoDoubles;
};
template <class T>
using Wide = typename WideType<T>::Type;

/// A place on the axis at depth z/w, vergence w/z: (Z, 1) for a distance, (1, U) for a vergence. Infinity is w = 0, and
/// each form keeps the digits it was given.
template <class T>
struct AxialPlace {
  T z;
  T w;
};

/// z - f w: the last coordinate of the image. Above zero beyond the front focal point, zero in its plane.
template <class T>
T BeyondFocalPoint(const T& f, const AxialPlace<T>& at) {
  return static_cast<T>(Wide<T>(at.z) - Wide<T>(f) * at.w);
}

/// M p with M = [[f,0,0,0],[0,f,0,0],[0,0,f,0],[0,0,1,-f]], for a point (x, y, z, w) standing for (x, y, z)/w; w = 0 is
/// a direction. Its own inverse up to scale: M M = f² I. Directions and the front focal-point plane are no special
/// case.
template <class T>
std::array<T, 4> Conjugate(const T& f, const std::array<T, 4>& point) {
  const auto& [x, y, z, w] = point;
  return {f * x, f * y, f * z, BeyondFocalPoint(f, AxialPlace<T>{z, w})};
}

/// Image depth behind the rear focal point, e = Z_i - f = f²/(Z_o - f) (Newton): what focuses on the place.
template <class T>
T Extension(const T& f, const AxialPlace<T>& at) {
  return f * f * at.w / BeyondFocalPoint(f, at);
}

/// Z_i = f Z_o/(Z_o - f): negative for a virtual image. Not in the front focal-point plane.
template <class T>
T ImageDepth(const T& f, const AxialPlace<T>& at) {
  return f * at.z / BeyondFocalPoint(f, at);
}

/// U_s = e/(f (f + e)) of the plane in focus: zero at infinity, negative past it.
template <class T>
T FocalPlane(const T& f, const T& extension) {
  return extension / (f * (f + extension));
}

/// A thin lens focused by its extension: f > 0, N > 0, e > -f.
template <class T>
struct Lens {
  T focal_length;
  T f_number;
  T extension;
};

/// s = (e - f (f + e) U)/N: positive behind the plane in focus (farther), negative in front of it. Any depth above
/// zero, inside the focal length too.
template <class T>
T SignedBlur(const Lens<T>& lens, const AxialPlace<T>& at) {
  const auto& [f, n, e] = lens;
  const Wide<T> here = (Wide<T>(at.z) - Wide<T>(f) * at.w) * e;
  return static_cast<T>(here - Wide<T>(f) * f * at.w) / at.z / n;
}

/// The same for a hole of this diameter without a lens, `distance` before the sensor: every subject is in front of what
/// would be in focus, so s = -A (1 + d U). A diameter of 0 is a pinhole.
template <class T>
T SignedBlurOfHole(const T& diameter, const T& distance, const AxialPlace<T>& at) {
  return -diameter * (at.z + distance * at.w) / at.z;
}

/// A disk across the axis: its centre and its diameter.
template <class T>
struct Disk {
  T x;
  T y;
  T diameter;
};

/// Forward projection: the area of a sensor at this distance that the scene point (x, y, z, w), z > 0, lights; `blur`
/// is the signed blur at its depth. The ray through the centre goes straight on: X_i/Z_s = X_o/Z_o.
template <class T>
Disk<T> LitBy(const std::array<T, 4>& point, const T& sensor_distance, const T& blur) {
  const auto& [x, y, z, w] = point;
  return {sensor_distance * x / z, sensor_distance * y / z, blur < 0 ? T(-blur) : blur};
}

/// Reverse projection: the area of the plane at `depth` that the sensor point (x, y) sees; `blur` is the signed blur at
/// that depth. The same rays as LitBy(), so a blur disk is this area as large as the sensor shows it.
template <class T>
Disk<T> SeenFrom(const T& x, const T& y, const T& sensor_distance, const T& depth, const T& blur) {
  const T scale = depth / sensor_distance;
  return {x * scale, y * scale, (blur < 0 ? T(-blur) : blur) * scale};
}

/// Vergences of the two ends of the depth of field for blur limit C: U_focus ± C N (1 - f U_focus)/f².
template <class T>
struct SharpVergences {
  T near;
  T far;  ///< not above zero: it reaches infinity
};
template <class T>
SharpVergences<T> DepthOfField(const T& f, const T& f_number, const T& blur_limit, const AxialPlace<T>& focus) {
  const T middle = focus.w / focus.z;
  const T half = blur_limit * f_number * BeyondFocalPoint(f, focus) / (f * f * focus.z);
  return {middle + half, middle - half};
}

/// The nearest focus whose depth of field reaches infinity: f + f²/(N C).
template <class T>
T Hyperfocal(const T& f, const T& f_number, const T& blur_limit) {
  return f + f * f / (f_number * blur_limit);
}

/// Light on the axis relative to an aperture as wide as its distance, by the working f-number N_w = Z_s/A: (A/Z_s)².
template <class T>
T ParaxialLight(const T& working_f_number) {
  return 1 / (working_f_number * working_f_number);
}
/// Exactly 4 sin²θ with tan θ = A/(2 Z_s): 0.17 stop less at f/1.4.
template <class T>
T ExactLight(const T& working_f_number) {
  return 4 / (4 * working_f_number * working_f_number + 1);
}

}  // namespace lensd::optics::thin_lens
