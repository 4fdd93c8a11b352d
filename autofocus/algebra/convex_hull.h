// The nearest point of a cloud of points and of all that lies between them.
#pragma once

#include <vector>

namespace lensd::autofocus {

/// `at` itself where it is between the points, to a millionth of a coordinate's unit.
std::vector<double> NearestBetween(const std::vector<std::vector<double>>& points, const std::vector<double>& at);

}  // namespace lensd::autofocus
