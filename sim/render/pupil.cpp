// The slopes of the wave aberration, and what cuts the pupil.
#include "sim/render/pupil.h"

#include <algorithm>
#include <cmath>

namespace lensd::sim {

double FocusOffM(const LensSettings& lens, FieldPoint at) {
  return 1e-6 * (lens.field_curvature_um * (at.x * at.x + at.y * at.y) + lens.sensor_tilt_um[0] * at.x +
                 lens.sensor_tilt_um[1] * at.y);
}

Pupil::Pupil(const LensSettings& lens, const CameraSettings& camera, const OpticalState& state) : lens_(lens) {
  const bool bends_focus =
      lens.field_curvature_um != 0.0 || lens.sensor_tilt_um[0] != 0.0 || lens.sensor_tilt_um[1] != 0.0;
  const bool does_something =
      lens.obstruction > 0.0 || lens.cats_eye > 0.0 || lens.spherical_um != 0.0 || lens.coma_um != 0.0 || bends_focus;
  if (!does_something || state.model != LensModel::Thin || state.aperture_diameter_m <= 0.0) return;
  is_perfect_ = false;
  const double pixel_m = camera.pixel_um * 1e-6;
  middle_ = {0.5 * camera.width, 0.5 * camera.height};
  half_diagonal_px_ = std::hypot(middle_.x, middle_.y);
  open_ = std::min(1.0, state.aperture_diameter_m * lens.min_f_number / state.focal_length_m);
  const double px_per_um = 2.0 * state.sensor_distance_m / state.aperture_diameter_m * 1e-6 / pixel_m;
  spherical_px_ = px_per_um * lens.spherical_um * std::pow(open_, 4);
  coma_px_ = px_per_um * lens.coma_um * std::pow(open_, 3);
  aperture_px_ = state.aperture_diameter_m / pixel_m;
  power_d_ = 1.0 / state.focal_length_m;
}

bool Pupil::is_uniform() const {
  return is_perfect_ || (lens_.cats_eye == 0.0 && lens_.coma_um == 0.0 && lens_.field_curvature_um == 0.0 &&
                         lens_.sensor_tilt_um[0] == 0.0 && lens_.sensor_tilt_um[1] == 0.0);
}

bool Pupil::Passes(AperturePoint h, FieldPoint at) const {
  if (h.x * h.x + h.y * h.y < 0.25 * lens_.obstruction * lens_.obstruction) return false;
  if (lens_.cats_eye == 0.0) return true;
  const double x = h.x * open_ - lens_.cats_eye * at.x, y = h.y * open_ - lens_.cats_eye * at.y;
  return x * x + y * y <= 0.25;
}

AperturePoint Pupil::LandsOff(AperturePoint h, FieldPoint at) const {
  const double x = 2.0 * h.x, y = 2.0 * h.y;
  const double rho_2 = x * x + y * y;
  const double spherical = spherical_px_ * (4.0 * rho_2 - 8.0 / 3.0);
  const double along = 2.0 * coma_px_ * (x * at.x + y * at.y);
  const double across = coma_px_ * (rho_2 - 1.0);
  return {-(spherical * x + along * x + across * at.x), -(spherical * y + along * y + across * at.y)};
}

BlurLine Pupil::LineAt(const BlurLine& middle, FieldPoint at) const {
  // As if the sensor stood so much nearer to the lens: d(U) = A (1 - Z_s (P - U)).
  const double nearer_px = aperture_px_ * FocusOffM(lens_, at);
  return {middle.at_infinity_px + nearer_px * power_d_, middle.per_dioptre_px - nearer_px};
}

double Pupil::DefocusReach(double vergence_d) const {
  const double farthest_m =
      1e-6 * (std::abs(lens_.field_curvature_um) + std::hypot(lens_.sensor_tilt_um[0], lens_.sensor_tilt_um[1]));
  return aperture_px_ * farthest_m * std::abs(power_d_ - vergence_d);
}

double Pupil::Reach(double vergence_d) const {
  if (is_perfect_) return 0.0;
  // The slopes are largest at the rim, or, where blades reach beyond rho = 1 (a triangle by 0.56), at their corners.
  const double corner = lens_.aperture_blades == 0 ? 1.0 : 1.56;
  return std::abs(spherical_px_) * (4.0 * corner * corner - 8.0 / 3.0) * corner +
         std::abs(coma_px_) * (3.0 * corner * corner - 1.0) + 0.5 * corner * DefocusReach(vergence_d);
}

double Pupil::ChangePerPx(double vergence_d, double blur_px) const {
  if (is_uniform()) return 0.0;
  const double cut = lens_.cats_eye / open_ * blur_px;
  return (cut + 3.0 * std::abs(coma_px_) + 2.0 * DefocusReach(vergence_d)) / half_diagonal_px_;
}

}  // namespace lensd::sim
