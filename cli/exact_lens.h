// The thin lens on the decimals of the command line. Close to the focal length the answer hangs on digits that the
// inputs lose when they are first rounded to doubles, so every formula here is one quotient of exact decimals, rounded
// at its very end. The formulas are those of optics/blur.h and optics/conjugates.h, cleared of their fractions.
#pragma once

#include <optional>

#include "base/result.h"
#include "base/units.h"
#include "cli/decimal.h"
#include "cli/quantity.h"

namespace lensd::cli {

/// numerator/denominator, exactly.
struct Ratio {
  Decimal numerator;
  Decimal denominator = Decimal(1, 0);

  bool IsPositive() const { return numerator.IsPositive() == denominator.IsPositive() && !numerator.IsZero(); }
  /// Within two roundings of exact; OutOfRange beyond what doubles hold or with a denominator of zero.
  Result<double> Value() const;
};

/// Vergence of a depth: U = 1/Z.
Ratio VergenceOf(const Depth& depth);

/// A thin lens: s = (e - (f + e) f U)/N.
struct ExactLens {
  Decimal focal_length;
  Ratio f_number;   ///< > 0
  Ratio extension;  ///< e > -f
};

/// e = f² U/(1 - f U); nothing at and inside the focal length.
std::optional<Ratio> ExtensionFocusedAt(const Decimal& focal_length, const Depth& focus);

/// Signed blur on the sensor, positive behind the focal plane.
Ratio SignedBlur(const ExactLens& lens, const Depth& object);

/// Z_i = f/(1 - f U), negative for virtual images; nothing at Z_o = f.
std::optional<Ratio> ImageDepth(const Decimal& focal_length, const Depth& object);

/// Vergences of the two ends of the depth of field for blur limit C: U_focus ± C N (1 - f U_focus)/f².
struct SharpVergences {
  Ratio near;
  Ratio far;  ///< not above zero: it reaches infinity
};
SharpVergences DepthOfField(const Decimal& focal_length, const Decimal& f_number, const Decimal& blur_limit,
                            const Depth& focus);

/// f + f²/(N C).
Ratio Hyperfocal(const Decimal& focal_length, const Decimal& f_number, const Decimal& blur_limit);

}  // namespace lensd::cli
