// The two numbers of the line, from the lens' state; a pinhole blurs nothing.
#include "sim/render/blur_line.h"

namespace lensd::sim {

BlurLine BlurLineOf(const CameraSettings& camera, const OpticalState& state) {
  if (state.model == LensModel::Pinhole) return {};
  const double aperture_px = state.aperture_diameter_m / (camera.pixel_um * 1e-6);
  const double power_d = state.model == LensModel::Thin ? 1.0 / state.focal_length_m : 0.0;
  return {.at_infinity_px = aperture_px * (1.0 - state.sensor_distance_m * power_d),
          .per_dioptre_px = aperture_px * state.sensor_distance_m};
}

double SignedBlurPx(const CameraSettings& camera, const OpticalState& state, double vergence_d) {
  return -BlurLineOf(camera, state).At(vergence_d);
}

}  // namespace lensd::sim
