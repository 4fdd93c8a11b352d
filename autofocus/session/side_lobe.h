// The contrast of a picture that repeats comes again under more blur, each time weaker: in the side lobes of a disk's
// response. Where focus lies beyond the range, one of them may be the sharpest place in it.
#pragma once

#include <span>

#include "autofocus/measures.h"
#include "autofocus/peak_fit.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// The picture at `top` has so few frequencies that its sharpness would rise again with more blur; and either the curve
/// does rise by more than a twelfth of the top on its way to an end (the lobe nearest to a focus is 1/57 of it, the
/// next are a quarter and more of the one before), or away from the top more is left than of such a picture in focus
/// there. `points` in order of position; `px`: change of position that changes blur by a pixel, right to 30 %; 0: it
/// is not known. Of the window its inner 256 px count.
bool MayBeSideLobe(std::span<const CurvePoint> points, const CurvePoint& top, double px, const drivers::Frame& frame,
                   const Window& window);

}  // namespace lensd::autofocus
