#include "cli/exact_lens.h"

#include <cmath>

namespace lensd::cli {
namespace {

/// 1 - f U, over the denominator of U.
Decimal GapNumerator(const Decimal& focal_length, const Ratio& vergence) {
  return vergence.denominator - focal_length * vergence.numerator;
}

}  // namespace

Result<double> Ratio::Value() const {
  const auto above = numerator.Nearest(), below = denominator.Nearest();
  const double value = above && below ? *above / *below : NAN;
  if (!std::isfinite(value)) return Fail(Code::OutOfRange, "the answer is too large or too small to represent");
  return value;
}

Ratio VergenceOf(const Depth& depth) {
  if (depth.IsDistance()) return {Decimal(1, 0), depth.exact};
  return {depth.exact, Decimal(1, 0)};
}

std::optional<Ratio> ExtensionFocusedAt(const Decimal& focal_length, const Depth& focus) {
  const Ratio vergence = VergenceOf(focus);
  const Decimal gap = GapNumerator(focal_length, vergence);
  if (!gap.IsPositive()) return std::nullopt;
  return Ratio{focal_length * focal_length * vergence.numerator, gap};
}

Ratio SignedBlur(const ExactLens& lens, const Depth& object) {
  const Ratio vergence = VergenceOf(object);
  const Decimal& f = lens.focal_length;
  const auto& [e, e_below] = lens.extension;
  const auto& [n, n_below] = lens.f_number;
  const Decimal image_side = e * vergence.denominator - (f * e_below + e) * f * vergence.numerator;
  return {image_side * n_below, n * e_below * vergence.denominator};
}

std::optional<Ratio> ImageDepth(const Decimal& focal_length, const Depth& object) {
  const Ratio vergence = VergenceOf(object);
  const Decimal gap = GapNumerator(focal_length, vergence);
  if (gap.IsZero()) return std::nullopt;
  return Ratio{focal_length * vergence.denominator, gap};
}

SharpVergences DepthOfField(const Decimal& focal_length, const Decimal& f_number, const Decimal& blur_limit,
                            const Depth& focus) {
  const Ratio vergence = VergenceOf(focus);
  const Decimal square = focal_length * focal_length;
  const Decimal half = blur_limit * f_number * GapNumerator(focal_length, vergence);
  const Decimal centre = square * vergence.numerator, below = square * vergence.denominator;
  return {{centre + half, below}, {centre - half, below}};
}

Ratio Hyperfocal(const Decimal& focal_length, const Decimal& f_number, const Decimal& blur_limit) {
  const Decimal spread = f_number * blur_limit;
  return {focal_length * spread + focal_length * focal_length, spread};
}

}  // namespace lensd::cli
