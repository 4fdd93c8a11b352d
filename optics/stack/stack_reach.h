// What a shot of a focus stack can keep sharp, over a stretch of f-numbers and with diffraction.
#pragma once

#include <array>
#include <optional>

namespace lensd::optics {

/// The lens of a request in plain numbers.
struct StackLens {
  double f = 0;
  double scale = 0;  ///< f p
  double airy = 0;   ///< k λ: diffraction disk over working f-number; 0 without a wavelength
  double delta = 0;
  double epsilon = 0;
  double low = 0;
  double high = 0;
};

/// All f-numbers from n_low to n_high (equal: one f-number) with total blur: what any of them allows. Depths are named
/// by their conjugate extension a, as in stack_cover.h; the f-numbers lie where diffraction alone stays within the
/// limits.
class StretchReach {
 public:
  StretchReach(const StackLens& lens, double n_low, double n_high);

  double HighestFor(double a, double limit) const;
  double LowestFor(double a, double limit) const;
  std::optional<double> NearestAt(double e, double limit) const;
  double FarthestAt(double e, double limit) const;

 private:
  struct Stretch {
    double low = 0.0;
    double high = 0.0;
    explicit operator bool() const { return high > 0.0; }
  };

  double RootAt(double n, double a, double limit, double side) const;
  double Root(const Stretch& stretch, double a, double limit, double side) const;
  double Part(double e, double limit) const;

  const StackLens& lens_;
  std::array<Stretch, 2> stretches_ = {};
};

}  // namespace lensd::optics
