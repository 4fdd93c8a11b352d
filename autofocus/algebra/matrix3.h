// Symmetric three by three matrices, as curves with three parameters need them.
#pragma once

#include <array>
#include <optional>

namespace lensd::autofocus {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;

/// Inverse of a symmetric matrix; nothing where it is singular.
std::optional<Matrix3> InverseOfSymmetric(const Matrix3& matrix);

}  // namespace lensd::autofocus
