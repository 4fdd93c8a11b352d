// The nearest and farthest depth of a depth map, or of one class of it: all that a limit on it needs.
#pragma once

#include <cstdint>
#include <span>

namespace lensd::optics {

struct DepthExtremes {
  std::uint16_t nearest = 0;
  std::uint16_t farthest = 0;
};

/// Of those depth samples (0: unknown) whose `classes` entry is `wanted`, in one pass at memory speed; {0, 0} when
/// there are none. Equal lengths.
DepthExtremes ExtremesOfClass(std::span<const std::uint16_t> depths, std::span<const std::uint16_t> classes,
                              std::uint16_t wanted);
/// The same of all known depth samples.
DepthExtremes ExtremesOfDepths(std::span<const std::uint16_t> depths);

}  // namespace lensd::optics
