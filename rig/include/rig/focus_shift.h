// Focus stands elsewhere at another f-number or behind another filter: by how much was measured, and what that says of
// a search that was made under one condition for work under another.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "base/units.h"

namespace lensd::rig {

/// What shifts focus: an f-number or a filter where the lens has one that moves, and the zoom that it counts for.
struct FocusConditions {
  std::optional<FNumber> f_number;
  std::optional<Native> filter;
  std::optional<Metres> focal_length;  ///< of a zoom
};

/// How far focus is from one place to another, with its standard deviation. Where the optics are known in metres of
/// extension, else in native units of focus.
struct ShiftSize {
  bool native = false;
  double value = 0.0;
  double sigma = 0.0;
};

/// A shift that was measured: exactly one of the two pairs is there, each from its first to its second.
struct FocusShift {
  std::optional<std::pair<FNumber, FNumber>> f_numbers;
  std::optional<std::pair<Native, Native>> filters;
  std::optional<Metres> focal_length;  ///< of a zoom
  ShiftSize size;
  int runs = 0;      ///< pairs of searches that it was measured by
  std::string made;  ///< when, for people
  /// Of the same pair, whichever way round, at the same zoom.
  bool SamePair(const FocusShift& other) const;
};

/// f-numbers, focal lengths: so near that they are the same.
bool SameFNumber(FNumber a, FNumber b);

/// From one condition to another: the sum of what was measured for their f-numbers and for their filters, either way
/// round, in metres or in native units as `native` says. An error says what was not measured.
Result<ShiftSize> ShiftBetween(const std::vector<FocusShift>& measured, const FocusConditions& from,
                               const FocusConditions& to, bool native);

/// "f/2.8 to f/8", "filter 3 to filter 1".
std::string PairText(const FocusShift& shift);

/// [[focus_shift]] of a calibration file.
Result<FocusShift> ReadFocusShift(const Settings& table);
std::string FocusShiftText(const FocusShift& shift);

}  // namespace lensd::rig
