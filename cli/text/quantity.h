// Quantities as people write them: `0.8m 850mm 33in 5ft7in 2.5D inf 8um 1.5px 550nm 3ms 25C 2%`, and as lensctl prints
// them: `1.2 m`, `infinity`, `1.2 m (0.8333 D)`. Exponents are legal;
// units convert in exact decimal, and what is returned exactly has a nearest double. Every function takes the text and
// the option it was given to, and fails with Code::InvalidArgument and one line that says what would fit.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "optics/decimal.h"

namespace lensd::cli {

using optics::Decimal;

/// A depth as it was written. The form matters: a distance keeps its digits near the focal length, a vergence far away.
struct Depth {
  enum class Form { Distance, Vergence };
  Form form = Form::Vergence;
  double value = 0.0;  ///< metres > 0, or dioptres; infinity is vergence 0
  Decimal exact = {};  ///< the same before rounding

  bool IsDistance() const { return form == Form::Distance; }
  bool IsInfinite() const { return form == Form::Vergence && value == 0.0; }
  Dioptres Vergence() const { return {IsDistance() ? 1.0 / value : value}; }

  /// Of a number that was computed, not written.
  static Depth Distance(double metres) { return {Form::Distance, metres, Decimal::Shortest(metres)}; }
};

/// Depths between two ends; `near` has the larger vergence, equal ends are one depth.
struct DepthRange {
  Depth near;
  Depth far;
};

/// An inclusive range, low <= high; one value has equal ends.
template <class Unit>
struct Span {
  Unit low;
  Unit high;
};

/// Openings (f-numbers, or aperture diameters) as a range, or as the stops that exist (ascending, no duplicates). One
/// value is a range of equal ends.
struct Openings {
  Span<Decimal> range;
  std::vector<Decimal> stops;  ///< empty: everything in the range
};

/// The one line about an option whose text does not fit: `OPTION 'TEXT': WHY`.
std::unexpected<Error> Wrong(std::string_view option, std::string_view text, std::string_view why);

/// Any length in metres, exactly; may be negative or zero.
Result<Decimal> ParseExactLength(std::string_view text, std::string_view option);
/// The same, rounded once.
Result<Metres> ParseLength(std::string_view text, std::string_view option);
/// A length > 0, exactly.
Result<Decimal> ParsePositiveLength(std::string_view text, std::string_view option);
/// `A..B` in either order, or one length.
Result<Span<Decimal>> ParseLengthRange(std::string_view text, std::string_view option);
/// A distance > 0, a vergence (negative is past infinity), or infinity (`inf`, `infinity`, its sign). What lensctl
/// prints in brackets behind it is the same depth and passed over.
Result<Depth> ParseDepth(std::string_view text, std::string_view option);
/// A real subject's depths, `A..B` in either order or one depth: vergence >= 0.
Result<DepthRange> ParseDepthRange(std::string_view text, std::string_view option);
/// A blur diameter > 0 as written, in metres or in pixels.
struct BlurSize {
  Decimal value;
  bool in_pixels = false;
};
Result<BlurSize> ParseBlur(std::string_view text, std::string_view option);
/// A blur diameter > 0 in metres, exactly. `px` needs the size of a pixel.
Result<Decimal> ParseBlurLimit(std::string_view text, const std::optional<Decimal>& pixel, std::string_view option);
/// The same of a blur that has been parsed.
Result<Decimal> BlurInMetres(const BlurSize& blur, std::string_view text, const std::optional<Decimal>& pixel,
                             std::string_view option);
/// `2.8`, `f/2.8`, `f2.8`, `F4` or `1:2.8`, > 0.
Result<Decimal> ParseFNumber(std::string_view text, std::string_view option);
/// One f-number, a range `1.4..22`, or the stops `1.4,2,2.8`.
Result<Openings> ParseFNumbers(std::string_view text, std::string_view option);
/// The same as lengths > 0: `3mm..20mm`.
Result<Openings> ParseDiameters(std::string_view text, std::string_view option);
/// `2%` is 0.02; >= 0.
Result<Decimal> ParsePercent(std::string_view text, std::string_view option);
/// A duration > 0, such as `500ms` or `1/250s`, rounded to the nanosecond.
Result<Duration> ParseTime(std::string_view text, std::string_view option);
/// A plain number without a unit.
Result<Decimal> ParseNumber(std::string_view text, std::string_view option);

/// The parts of a list, empty ones too.
std::vector<std::string_view> SplitAtCommas(std::string_view text);

}  // namespace lensd::cli
