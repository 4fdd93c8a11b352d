// How focus goes with the temperature of a lens, learned from what autofocus found at which temperature and from
// nothing else.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "base/units.h"

namespace lensd::rig {

/// Focus as one autofocus found it.
struct DriftSample {
  static constexpr std::size_t kMost = 200;  ///< that are kept: the newest
  int subject =
      1;  ///< results with the same number are of the same thing at the same distance, under the same conditions
  Celsius temperature;
  Metres extension;    ///< of the position where focus was found, corrected for no temperature
  Metres sigma;        ///< of that, above zero
  std::string made{};  ///< when, for people
  Metres off{};        ///< by the newest fit: how far it is from what the coefficient says
  bool outlier = false;
};

/// The coefficient, with its 95 % interval.
struct FocusDrift {
  Metres per_degree;  ///< extension gained per degree at one focus position: focus has to lose it again
  Metres low;
  Metres high;
  Celsius coldest;  ///< of the samples it was learned from
  Celsius hottest;
  int used = 0;
};

/// Weighted least squares with one coefficient for all subjects, and for each a place of its own. The interval is
/// Student's over the scatter about it, so that it does not rest on the sigmas being true but only on their ratios. A
/// sample that the coefficient through all others misses by far is an outlier and left out, a third of them at most.
/// OutOfRange: too few of them, or at too similar temperatures; the message says what is missing.
Result<FocusDrift> FitFocusDrift(std::vector<DriftSample>& samples);

/// The file of what was learned: version = 1, [[result]]. BadData: "file:line: what is wrong".
Result<std::vector<DriftSample>> ReadFocusDrift(const Settings& file);
std::string FocusDriftText(const std::vector<DriftSample>& samples);

}  // namespace lensd::rig
