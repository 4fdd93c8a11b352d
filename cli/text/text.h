// Numbers, depths and tables for people.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity_text.h"
#include "base/units.h"

namespace lensd::cli {

/// In what distances are shown.
enum class DistanceUnit { Metres, Millimetres, Feet, Inches, Dioptres };
/// Their names on the command line, in that order.
inline constexpr std::array<std::string_view, 5> kDistanceUnits = {"m", "mm", "ft", "in", "D"};

/// The unit of the first distance on this command line (`--focus 33in`), metres where there is none. Of a range it is
/// that of its first end that is not infinity.
DistanceUnit UnitOfFirstDistance(std::span<const char* const> arguments);

/// The unit DepthText() writes in: of the whole process, set once before the command runs. Metres until then.
void ShowDistancesIn(DistanceUnit unit);
DistanceUnit ShownDistanceUnit();

/// From now on texts say that their distances start at the lens centre: where the person's own start elsewhere.
void SayWhereDistancesStart();
/// " from the lens centre" where that is to be said, otherwise nothing.
std::string_view OriginWords();
/// The same as a line below a table.
std::string_view OriginLine();

/// A distance in the unit of the process, in km from 100 km on: "2.31 m", "7.58 ft".
std::string DistanceText(Metres distance);
/// A depth as "2.31 m (0.433 D)", "infinity (0 D)" or "past infinity (-0.1 D)"; in dioptres "0.433 D (2.31 m)".
std::string DepthText(Dioptres vergence);

/// Rows of cells as aligned columns. Columns that hold only numbers below the first row align to the right.
std::string TableText(const std::vector<std::vector<std::string>>& rows);

}  // namespace lensd::cli
