// How far a ray walks off across the picture, from the geometry of rays alone.
//
// A scene point at depth Z sends a cone of rays to the aperture. The ray through the lens centre goes straight on and
// meets the sensor at the point's place in the picture, q. A thin lens of power P bends the ray that passes it at
// height h by an angle h P, so that all rays of the cone meet at depth V with 1/V = P - 1/Z (without a lens P = 0 and
// they go on spreading from the point). The rays of the cone lie, at depth t behind the lens, at q t / Z_s + h (1 - t /
// V): they start at height h and close linearly, V being where they meet. On the sensor (t = Z_s) the ray is found at
//     p = q + h (1 - Z_s (P - U)),   U = 1/Z,
// a disk of diameter A |1 - Z_s (P - U)|. Read backwards, the sensor point p sees through aperture height h the place
//     q = p - h (1 - Z_s P) - h Z_s U :
// in picture coordinates and vergence every ray is a straight line, which is all the renderers need. Heights are in
// units of the aperture's diameter here (|h| <= 1/2) and lengths on the sensor in pixels.
#pragma once

#include "sim/render.h"

namespace lensd::sim {

/// d(U) = at_infinity_px + per_dioptre_px U: a ray through aperture point h (in diameters from the centre) that meets
/// the sensor at p passes vergence U at p - h d(U). |d| is the blur disk's diameter; d < 0 behind the focal plane.
struct BlurLine {
  double at_infinity_px = 0.0;
  double per_dioptre_px = 0.0;

  double At(double vergence_d) const { return at_infinity_px + per_dioptre_px * vergence_d; }
};

BlurLine BlurLineOf(const CameraSettings& camera, const OpticalState& state);

}  // namespace lensd::sim
