// Conflicts that hold whatever they were guessed by.
#pragma once

#include <functional>
#include <optional>
#include <vector>

namespace lensd::optics {

/// Nothing: `names` are infeasible together. Else other names that a setting which meets them all breaks; none, where
/// it is not known whether there is such a setting.
using Refute = std::function<std::optional<std::vector<int>>(const std::vector<int>& names)>;

/// Names that `refute` finds infeasible: `guess`, or, where that is feasible, what it grows to by what its settings
/// break, less what can be dropped again. `everything` where that does not end.
std::vector<int> CertainConflict(std::vector<int> guess, const std::vector<int>& everything, const Refute& refute);

}  // namespace lensd::optics
