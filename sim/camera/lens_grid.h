// Rounding a lens state to the next of a discrete set, so that runs which pass the same place share a picture.
#pragma once

#include <compare>
#include <cstdint>

#include "sim/render.h"
#include "sim/scene.h"

namespace lensd::sim {

/// The vergences of a scene's surfaces and lights, 0 <= far_d <= near_d.
struct VergenceSpan {
  double far_d = 0.0;
  double near_d = 0.0;
};
VergenceSpan SpanOf(const Scene& scene);

/// The spacing of the set: blur of the subject nearest to focus moves by at most 1/128 px or 1/256 of itself, whichever
/// is larger; aperture, focal length and magnification are kept to 1/512, 5e-7 and 5e-7 of themselves.
class LensGrid {
 public:
  explicit LensGrid(const Scene& scene) : span_(SpanOf(scene)), pixel_m_(scene.camera.pixel_um * 1e-6) {}

  /// A grid point: equal keys, equal states.
  struct Key {
    LensModel model = LensModel::Thin;
    std::int64_t focal_length = 0;
    std::int64_t aperture = 0;
    std::int64_t extension = 0;
    std::int64_t magnification = 0;
    auto operator<=>(const Key&) const = default;
  };
  Key KeyOf(const OpticalState& state) const;
  OpticalState StateOf(const Key& key) const;

 private:
  struct Focus;
  Focus FocusOf(double focal_length_m, double aperture_m) const;

  VergenceSpan span_;
  double pixel_m_;
};

}  // namespace lensd::sim
