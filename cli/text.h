// Numbers and tables for people.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/units.h"

namespace lensd::cli {

/// A few significant digits, no more than the reader needs: "2.8", "0.0125".
std::string Short(double value, int digits = 4);
/// A length in the unit that suits its size: "8.03 um", "51.3 mm", "2.31 m".
std::string LengthText(Metres length);
/// A depth as "2.31 m (0.433 D)", "infinity (0 D)" or "past infinity (-0.1 D)".
std::string DepthText(Dioptres vergence);

/// Rows of cells as aligned columns. Columns that hold only numbers below the first row align to the right.
std::string TableText(const std::vector<std::vector<std::string>>& rows);

}  // namespace lensd::cli
