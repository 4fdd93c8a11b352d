// How sharp a window of a frame is: sums over local differences, all in exact integers, so that every build and every
// instruction set gives the same number.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "drivers/api/camera.h"

namespace lensd::autofocus {

/// A rectangle of whole pixels of a frame.
struct Window {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend bool operator==(const Window&, const Window&) = default;
};

/// A view of samples that the caller keeps alive: rows of `width` samples, `stride` samples apart.
template <class Sample>
struct GreyView {
  const Sample* samples = nullptr;
  int width = 0;   ///< px, >= 3
  int height = 0;  ///< px, >= 3
  std::ptrdiff_t stride = 0;
};

/// What one pass over a window finds. Light is in units of full scale, distances in pixels.
struct FocusScore {
  /// Mean squared gradient (Tenengrad): Sobel's two slopes over 8, squared and added. White noise of variance v adds
  /// 0.375 v.
  double gradient_energy = 0.0;
  /// Standard deviation of white noise, from the mean size of a second difference along both axes. Smooth shading and
  /// straight edges along an axis leave it alone; fine texture raises it, so it is an upper bound.
  double noise = 0.0;
  double saturated_fraction = 0.0;  ///< of all samples of the window, at full scale
  double mean = 0.0;                ///< of all samples of the window
  /// Standard deviation of gradient_energy from frame to frame where a client gave it; 0: follows from
  /// `noise`.
  double energy_sigma = 0.0;
};

/// Everything in one pass. Windows are at least 3 x 3 px and inside the frame, else InvalidArgument.
Result<FocusScore> ScoreFocus(const drivers::Frame& frame, Window window);

/// Raw sums over the inner pixels of a view (all but its outermost ring), in sample units.
struct FocusSums {
  std::uint64_t gradient = 0;      ///< sum of Sobel gx^2 + gy^2
  std::uint64_t noise = 0;         ///< sum of |second difference along both axes|, mask (1 -2 1)(1 -2 1)
  std::uint64_t noise_pixels = 0;  ///< over so many inner pixels: a part of them serves where they are many
  std::uint64_t saturated = 0;     ///< samples >= full_scale, of the whole view
  std::uint64_t light = 0;         ///< sum of samples, of the whole view
  friend bool operator==(const FocusSums&, const FocusSums&) = default;
};
/// Sums of the four-neighbour Laplacian over the inner pixels.
struct LaplacianSums {
  std::int64_t value = 0;
  std::uint64_t square = 0;
  friend bool operator==(const LaplacianSums&, const LaplacianSums&) = default;
};
FocusSums SumFocus(GreyView<std::uint8_t> view, std::uint8_t full_scale = 255);
FocusSums SumFocus(GreyView<std::uint16_t> view, std::uint16_t full_scale);
std::uint64_t SumGradient(GreyView<std::uint8_t> view);
/// Over all pairs two apart in a row, in every row of the view.
std::uint64_t SumBrenner(GreyView<std::uint8_t> view);
LaplacianSums SumLaplacian(GreyView<std::uint8_t> view);

}  // namespace lensd::autofocus
