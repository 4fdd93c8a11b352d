// Places of pixels made even on smooth things, without mixing a thing with what stands before it.
#pragma once

#include <vector>

#include "sharpness.h"

namespace lensd::merge {

/// `place` and `sigma` (NaN: unknown) after each known pixel has become the mean of those within `radius` that agree
/// with it within a few `step`s and their sigmas, each weighing as it is certain. A pixel with which hardly any other
/// agrees is unknown from then on.
void SmoothPlaces(Plane& place, Plane& sigma, int width, int height, int radius, float step);

/// Makes places unknown that have one smaller by more than `drop` within `radius`: around a near thing (places rise
/// toward near) the window of sharpness sees its rim, and takes what is beside it for near.
void LeaveRims(Plane& place, Plane& sigma, int width, int height, int radius, float drop);

/// Unknown places get a mean of the known ones around them, the wider the farther those are. At least one is known, or
/// all become `otherwise`.
Plane FilledPlaces(const Plane& place, const Plane& sigma, int width, int height, float otherwise);

}  // namespace lensd::merge
