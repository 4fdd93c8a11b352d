// Textures that repeat: their contrast comes again far out of focus, so that a top with less sharp frames on both sides
// need not be the one.
#pragma once

#include <vector>

#include "autofocus/defocus/rings.h"

namespace lensd::autofocus::defocus {

constexpr double kBlurStep = 0.5;  ///< px
constexpr int kSmallSide = 32;     ///< px: a picture no larger shows too few frequencies for RiseWithBlur()

/// Sharpness of such a picture, over that of it as it is, as a disk of blur grows from 0 in steps of kBlurStep to
/// `most_px` or 0.6 of the side. Empty: no frequency stands out of the noise.
std::vector<double> SharpnessUnderBlur(const Tiles& tiles, double most_px);

/// How sharpness would go as such a picture is blurred by a disk that grows to `most_px`: the most by which it rises
/// again, as a factor of what it was before. 1: it only falls, as that of a texture of many frequencies does.
double RiseWithBlur(const Tiles& tiles, double most_px);

/// The share, 0..1, of a picture's gradient energy that its two strongest gratings have. It needs no more than a small
/// window: out of focus, at a side lobe, a grating has lost its harmonics and is nearly all of its picture. 0: nothing
/// stands out of the noise.
double ShareOfTwoGratings(const Spectrum& picture);

}  // namespace lensd::autofocus::defocus
