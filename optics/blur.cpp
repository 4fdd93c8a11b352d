#include "optics/blur.h"

#include <cmath>

namespace lensd::optics {
namespace {

// Products and sums as an exact pair (value, remainder). Blur near the plane in focus is a small difference of nearly
// equal products, and rounding those first would leave nothing of it.
struct Pair {
  double value;
  double rest;
};

Pair ExactProduct(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

Pair ExactSum(double a, double b) {
  const double sum = a + b;
  const double b_kept = sum - a;
  return {sum, (a - (sum - b_kept)) + (b - b_kept)};
}

/// a b for pairs, correct to about 2^-100.
Pair Product(Pair a, Pair b) {
  Pair product = ExactProduct(a.value, b.value);
  product.rest += a.value * b.rest + a.rest * b.value;
  return product;
}

/// a - b for pairs, rounded once.
double Difference(Pair a, Pair b) {
  const Pair head = ExactSum(a.value, -b.value);
  return head.value + (head.rest + (a.rest - b.rest));
}

}  // namespace

// s N = e - f (f + e) U from a vergence, and (e (Z - f) - f²)/Z from a distance: the same quantity, neither of them
// passing through the other's rounding.
Metres SignedBlur(const ThinLens& lens, ObjectDepth object) {
  const double f = lens.focal_length.value;
  const double e = lens.extension.value;
  const double n = lens.f_number.value;
  const auto distance = object.distance();
  if (object.is_distance() && distance) {
    const double z = distance->value;
    return {Difference(Product({e, 0.0}, ExactSum(z, -f)), ExactProduct(f, f)) / z / n};
  }
  const Pair product = Product(ExactProduct(f, object.vergence().value), ExactSum(f, e));
  return {Difference({e, 0.0}, product) / n};
}

Metres SignedBlur(Metres focal_length, FNumber f_number, ObjectDepth focus, ObjectDepth object) {
  const double aperture = focal_length.value / f_number.value;
  return {aperture * focal_length.value * VergenceDifference(focus, object).value / focus.FocusGap(focal_length)};
}

Metres Blur(const ThinLens& lens, ObjectDepth object) {
  return {std::abs(SignedBlur(lens, object).value)};
}

double PupilDivisor(Metres focal_length, ObjectDepth object, double pupil_factor) {
  return std::fma(focal_length.value * object.vergence().value, (1.0 - pupil_factor) / pupil_factor, 1.0);
}

}  // namespace lensd::optics
