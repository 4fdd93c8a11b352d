// GenICam descriptions gone wrong, drawn from a seed: references of every kind between nodes that never had any.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace lensd::testing {

/// One of `good`, with what the `seed` makes of it. Equal seeds give equal descriptions.
std::string DrawDescription(std::span<const std::string> good, std::uint64_t seed);

}  // namespace lensd::testing
