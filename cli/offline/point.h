// Points of the scene and of the sensor on the command line, exactly.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "base/result.h"
#include "optics/decimal.h"

namespace lensd::cli {

/// `X,Y,Z` as lengths, Z may be inf (the direction of the axis: from there a finite X and Y make no difference), or the
/// homogeneous `X,Y,Z,W` as plain numbers in metres.
Result<std::array<optics::Rational, 4>> ParsePoint(const std::string& text, std::string_view option);

/// `X,Y` as lengths.
Result<std::array<optics::Rational, 2>> ParsePlanePoint(const std::string& text, std::string_view option);

}  // namespace lensd::cli
