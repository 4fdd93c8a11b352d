// The Cramer-Rao bound for focus from given frames on a known texture: what the light allows, whatever the method.
#include "bench/autofocus/floor.h"

#include <kissfft/kiss_fftnd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>

#include "base/clock.h"
#include "sim/world.h"

namespace lensd::bench {
namespace {

constexpr int kSide = 192;              // px of the window whose modes count, as large as the frame allows
constexpr double kWhite = 0.9;          // of full well
constexpr double kWorthOfAMode = 3.78;  // modes under a Hann window that are worth one independent mode
constexpr double kHighest = 0.45;       // cycles per px

/// d/ds of 2 J1(pi s f)/(pi s f), and the function itself.
std::pair<double, double> Response(double blur_px, double frequency) {
  const double x = std::numbers::pi * std::abs(blur_px) * frequency;
  if (x < 1e-6) return {1.0, 0.0};
  const double value = 2.0 * std::cyl_bessel_j(1.0, x) / x;
  const double slope = -2.0 * std::cyl_bessel_j(2.0, x) / x;  // by x
  return {value, slope * std::numbers::pi * frequency * (blur_px < 0 ? -1.0 : 1.0)};
}

/// Variance of one sample's noise at this light, relative to the light squared.
double NoiseOf(const sim::CameraSettings& camera, double mean) {
  const double step = 1.0 / (std::exp2(camera.bits) - 1.0);
  double variance = step * step / 12.0;
  if (camera.full_well_e) {
    const double electrons = kWhite * mean * *camera.full_well_e;
    variance += (electrons + camera.read_noise_e * camera.read_noise_e) / (*camera.full_well_e * *camera.full_well_e);
  }
  return variance / (kWhite * mean * kWhite * mean);
}

/// A square in the middle of the region of truth, and a Hann window over it.
std::pair<std::vector<double>, std::vector<double>> Windowed(const sim::Scene& scene,
                                                             std::span<const std::uint16_t> picture, int side) {
  const auto from = [side](double middle, int size) {
    return std::clamp(static_cast<int>(middle * size) - side / 2, 0, size - side);
  };
  const auto hann = [side](int i) { return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (i + 0.5) / side); };
  const int left = from(scene.truth_region.x + scene.truth_region.w / 2, scene.camera.width);
  const int upper = from(scene.truth_region.y + scene.truth_region.h / 2, scene.camera.height);
  std::vector<double> light, weights;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto at = static_cast<std::size_t>(upper + y) * static_cast<std::size_t>(scene.camera.width) +
                      static_cast<std::size_t>(left + x);
      light.push_back(picture[at] / 65535.0);
      weights.push_back(hann(x) * hann(y));
    }
  }
  return {std::move(light), std::move(weights)};
}

}  // namespace

Result<FocusFloor> FocusFloor::Create(sim::Pictures& pictures) {
  const sim::Scene& scene = pictures.scene();
  SteppedClock clock;
  auto world = sim::OpenWorld(std::shared_ptr<const sim::Scene>(std::shared_ptr<void>(), &scene), clock);
  if (!world) return PassOn(world);
  const auto& subjects = world->truth->subjects();
  if (subjects.size() != 1) return Fail(Code::InvalidArgument, "the bound is for a region with one subject");
  sim::TrueState state = world->truth->Now();
  const double f = state.optics.focal_length_m;
  state.optics.sensor_distance_m = 1.0 / (1.0 / f - subjects.front().vergence_d);
  auto picture = pictures.At(state.optics);
  if (!picture) return PassOn(picture);

  FocusFloor floor;
  const double pixel_m = scene.camera.pixel_um * 1e-6;
  const double step_m = 1e-3 * (scene.lens.max_extension_mm - scene.lens.min_extension_mm) / (scene.lens.steps - 1.0);
  floor.quantisation_px_ = step_m * state.optics.aperture_diameter_m / f / pixel_m / std::sqrt(12.0);

  const int side = std::min({kSide, scene.camera.width / 2 * 2, scene.camera.height / 2 * 2});
  const auto [light, weights] = Windowed(scene, (*picture)->light, side);
  const double weight = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double mean = std::inner_product(light.begin(), light.end(), weights.begin(), 0.0) / weight;
  if (!(mean > 0)) return Fail(Code::InvalidArgument, "there is no light in the region");
  const double square = std::inner_product(weights.begin(), weights.end(), weights.begin(), 0.0);
  std::vector<kiss_fft_cpx> field(light.size()), modes(light.size());
  double variance = 0.0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double relative = light[i] / mean - 1.0;
    variance += relative * relative * weights[i] / weight;
    field[i] = {static_cast<float>(relative * weights[i] / std::sqrt(square)), 0.0f};
  }
  const int sizes[] = {side, side};
  const kiss_fftnd_cfg plan = kiss_fftnd_alloc(sizes, 2, 0, nullptr, nullptr);
  kiss_fftnd(plan, field.data(), modes.data());
  kiss_fft_free(plan);
  const double noise = NoiseOf(scene.camera, mean);
  floor.contrast_ = std::sqrt(variance);
  floor.signal_to_noise_ = std::sqrt(variance / noise);
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i <= side / 2; ++i) {
      const double fy = (j <= side / 2 ? j : j - side) / static_cast<double>(side);
      const double frequency = std::hypot(i / static_cast<double>(side), fy);
      if (frequency < 2.5 / side || frequency > kHighest || (i == 0 && fy < 0)) continue;
      const kiss_fft_cpx& mode = modes[static_cast<std::size_t>(j * side + i)];
      const double power = (static_cast<double>(mode.r) * mode.r + static_cast<double>(mode.i) * mode.i) / noise;
      floor.modes_.push_back({frequency, power});
    }
  }
  return floor;
}

/// With y_i = H_i T + noise and T unknown, what is left of the information on a parameter is the part of dH that is not
/// along H. The parameters are the focus, by which every blur changes alike, and the slope, by which each changes in
/// proportion.
double FocusFloor::BoundPx(std::span<const double> blurs_px, double slope_sigma) const {
  double by_focus = 0.0, by_slope = 0.0, by_both = 0.0;
  for (const Mode& mode : modes_) {
    double value2 = 0.0, along_focus = 0.0, along_slope = 0.0;
    double focus2 = 0.0, slope2 = 0.0, both = 0.0;
    for (const double blur : blurs_px) {
      const auto [value, change] = Response(blur, mode.frequency);
      value2 += value * value;
      along_focus += change * value;
      along_slope += blur * change * value;
      focus2 += change * change;
      slope2 += blur * blur * change * change;
      both += blur * change * change;
    }
    if (!(value2 > 0)) continue;
    by_focus += 2.0 * mode.power * std::max(focus2 - along_focus * along_focus / value2, 0.0);
    by_slope += 2.0 * mode.power * std::max(slope2 - along_slope * along_slope / value2, 0.0);
    by_both += 2.0 * mode.power * (both - along_focus * along_slope / value2);
  }
  double information = by_focus / kWorthOfAMode;
  if (slope_sigma > 0) {
    const double slope = by_slope / kWorthOfAMode + 1.0 / (slope_sigma * slope_sigma);
    information -= by_both / kWorthOfAMode * (by_both / kWorthOfAMode) / slope;
  }
  return information > 0 ? 1.0 / std::sqrt(information) : std::numeric_limits<double>::infinity();
}

}  // namespace lensd::bench
