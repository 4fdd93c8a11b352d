// Quantities and names as the interface writes them.
#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <string_view>

#include "base/clock.h"
#include "base/units.h"
#include "varlink/json.h"

namespace lensd::daemon {

inline double Milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

template <class Unit>
varlink::Json Optional(const std::optional<Quantity<Unit>>& quantity, double per_unit = 1.0) {
  return quantity ? varlink::NumberOrNull(quantity->value * per_unit) : varlink::Json(nullptr);
}

inline constexpr double kMmPerMetre = 1e3;
inline constexpr double kUmPerMetre = 1e6;

/// Null at infinity and past it.
inline varlink::Json DistanceJson(const std::optional<Dioptres>& vergence) {
  return vergence && vergence->value > 0.0 ? varlink::NumberOrNull(1.0 / vergence->value) : varlink::Json(nullptr);
}

/// The name of an enumeration's value from a list in the same order.
template <std::size_t N, class Value>
std::string_view NameIn(const std::array<std::string_view, N>& names, Value value) {
  return names.at(static_cast<std::size_t>(value));
}

}  // namespace lensd::daemon
