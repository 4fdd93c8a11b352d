// Power and cross spectra of a picture and of its ever more blurred reference, by parts of the frame.
#pragma once

#include <span>
#include <vector>

#include "verify/disk_blur.h"

namespace lensd::verify {

/// Blocks of kBlock x kBlock pixels are transformed one by one; their frequencies are gathered in rings of 1/kBlock
/// cycles a pixel.
inline constexpr int kBlock = 64;
inline constexpr int kRings = 46;        ///< up to the corner of the spectrum
inline constexpr double kStepPx = 0.25;  ///< from one diameter of the row to the next

/// The middle of a ring, cycles/px.
constexpr double FrequencyOf(int ring) {
  return ring / static_cast<double>(kBlock);
}
/// How many of a block's kBlock * kBlock frequencies lie in each ring.
const std::vector<double>& FrequenciesIn();

using Rings = std::vector<double>;

/// Sums over one part of the frame. Of block means, which brightness falling off toward the corners would change,
/// nothing is left in them.
struct Spectra {
  long pixels = 0;
  double noise_error = 0.0;       ///< relative, of all `noise` alike
  double opening = 0.0;           ///< see FramesToCompare
  Rings picture = Rings(kRings);  ///< sum of |P|^2
  struct Step {                   ///< the reference blurred by its place in the row, times kStepPx
    Rings cross = Rings(kRings);  ///< sum of Re(P B*)
    Rings power = Rings(kRings);  ///< sum of |B|^2
    Rings noise = Rings(kRings);  ///< what of `power` is the reference's noise, expected
  };
  std::vector<Step> steps;
};

/// The frames to take spectra of, and how they are divided.
struct DividedFrames {
  Plane picture;
  Plane reference;
  std::vector<float> reference_variance;  ///< of the reference's noise, a pixel each
  double reference_variance_error = 0.0;  ///< relative, of all of them alike
  double reference_opening = 0.0;         ///< see FramesToCompare
  std::vector<int> part;                  ///< of each pixel, -1: none
  int parts = 0;
};

/// How the reference becomes one part of the picture, and what each frequency's misfit weighs: one over its variance.
struct PartModel {
  double diameter_px = 0.0;
  double gain = 0.0;
  Rings weight = Rings(kRings);
};

/// By what the picture is displaced still, to first order, and what that weighs: one over the square of its standard
/// error along the axis where it is larger.
struct Displacement {
  Shift shift;
  double weight = 0.0;
};

/// Takes spectra again and again with the reference moved a little further.
class SpectraTaker {
 public:
  /// For diameters of the row up to `steps` - 1.
  SpectraTaker(DividedFrames frames, int steps);
  ~SpectraTaker();
  SpectraTaker(const SpectraTaker&) = delete;
  SpectraTaker& operator=(const SpectraTaker&) = delete;

  /// The spectra of every part, for the first `steps` diameters and with the reference moved by `shift`.
  std::vector<Spectra> Take(int steps, Shift shift) const;
  std::vector<Spectra> Take(Shift shift) const;
  /// The displacement all parts have in common; a part whose gain is 0 does not count.
  Displacement DisplacementOf(const std::vector<PartModel>& models, Shift shift) const;

 private:
  struct Patch;
  std::vector<Patch> Patches() const;
  std::vector<float> ShapeOf(const Patch& patch) const;

  DividedFrames frames_;
  DiskBlur blur_;
  std::vector<Patch> patches_;
  std::vector<Spectra> at_rest_;  ///< what does not change with the displacement: pixels, picture and noise
};

}  // namespace lensd::verify
