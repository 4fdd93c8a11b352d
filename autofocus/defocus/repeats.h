// Textures that repeat: their contrast comes again far out of focus, so that a top with less sharp frames on both sides
// need not be the one.
#pragma once

#include "defocus/rings.h"

namespace lensd::autofocus::defocus {

/// How sharpness would go as such a picture is blurred by a disk that grows to `most_px`: the most by which it rises
/// again, as a factor of what it was before. 1: it only falls, as that of a texture of many frequencies does.
double RiseWithBlur(const Tiles& tiles, double most_px);

}  // namespace lensd::autofocus::defocus
