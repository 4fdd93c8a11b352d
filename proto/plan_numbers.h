// Numbers of a plan between their units: changed by moving the decimal exponent, never by a rounded factor.
#pragma once

#include "optics/planner.h"

namespace lensd::proto {

/// Powers of ten from the planner's units (metres, plain) to those of JSON.
inline constexpr int kMm = 3, kUm = 6, kNm = 9, kPlain = 0;

/// The number times 10^shift, rounded once.
double Out(const optics::Number& number, int shift);
/// The shortest decimal that reads back as `value`, over 10^shift.
optics::Number In(double value, int shift);

inline constexpr const char* kObjectives[] = {"light", "sharp", "depth"};

}  // namespace lensd::proto
