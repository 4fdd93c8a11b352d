// What a real lens adds to the cone of rays behind its opening.
//
// An aberration W(rho), the optical path by which the wave runs ahead of a sphere at a point rho of the pupil (1: its
// rim), turns the ray there by the slope of W. At the sensor, Z_s behind the opening of diameter A, the ray lands
//     eps = -(2 Z_s/A) dW/d(rho)
// away from where the ideal ray does (Welford, Aberrations of Optical Systems, ch. 7; Mahajan, Optical Imaging and
// Aberrations I, 3.4). That does not depend on where the ray came from, so a ray still is a straight line in picture
// coordinates and vergence (blur_line.h), set off by eps: rays need nothing else, occlusion included. The two of
// Seidel's sums that matter for focus, f being the place in the field, its corners at |f| = 1, and a = A/A_widest:
//     spherical   W040 a^4 (rho^4 - 4/3 rho^2): counted from where the spot's mean square is smallest
//     coma        W131 a^3 (rho^2 - 1) (rho . f): counted so that the spot's middle stays in place
// Coefficients are for the widest opening. A second rim, as large as the widest opening and seen `cats_eye` of its
// diameter off at the corners, cuts the pupil to a cat's eye; an obstruction hides the middle. Field curvature and tilt
// set the place of best focus off by curvature |f|^2 + tilt . f.
#pragma once

#include "sim/render.h"
#include "sim/render/aperture_shape.h"
#include "sim/render/blur_line.h"

namespace lensd::sim {

/// A place in the picture: from the frame's middle, in half diagonals.
struct FieldPoint {
  double x = 0.0;
  double y = 0.0;
};

class Pupil {
 public:
  /// Nothing but its outline.
  Pupil() = default;
  Pupil(const LensSettings& lens, const CameraSettings& camera, const OpticalState& state);

  bool is_perfect() const { return is_perfect_; }
  /// Whether it is the same all over the field.
  bool is_uniform() const;
  /// Of a point of the picture, in pixels.
  FieldPoint FieldAt(double x, double y) const {
    return {(x - middle_.x) / half_diagonal_px_, (y - middle_.y) / half_diagonal_px_};
  }

  /// Whether light goes through that point of the opening.
  bool Passes(AperturePoint h, FieldPoint at) const;
  /// px by which the ray through that point lands off the ideal one.
  AperturePoint LandsOff(AperturePoint h, FieldPoint at) const;
  /// The blur there, of that in the frame's middle.
  BlurLine LineAt(const BlurLine& middle, FieldPoint at) const;

  /// px: no ray lands farther off, and focus differing over the field included for a subject of that vergence.
  double Reach(double vergence_d) const;
  /// How many px, at most, a ray's place changes a pixel across the frame; `blur_px` is the blur's diameter.
  double ChangePerPx(double vergence_d, double blur_px) const;
  /// How far the second rim moves a pixel across the frame, in openings.
  double CutPerPx() const { return lens_.cats_eye / open_ / half_diagonal_px_; }

 private:
  /// px by which the blur's diameter changes from the middle of the frame to where focus differs most.
  double DefocusReach(double vergence_d) const;

  bool is_perfect_ = true;
  LensSettings lens_;
  AperturePoint middle_;  ///< of the frame, px
  double half_diagonal_px_ = 1.0;
  double open_ = 1.0;          ///< the opening now over the widest
  double spherical_px_ = 0.0;  ///< 2 Z_s/A W040 a^4
  double coma_px_ = 0.0;       ///< 2 Z_s/A W131 a^3
  double aperture_px_ = 0.0;
  double power_d_ = 0.0;
};

/// m by which best focus at that place of the field lies farther behind the lens than in the frame's middle.
double FocusOffM(const LensSettings& lens, FieldPoint at);

}  // namespace lensd::sim
