// The table of difficulties.
#include "bench/autofocus/variations.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>

namespace lensd::bench {
namespace {

constexpr int kFewRuns = 20;       // of aberrations, whose kernels are traced
constexpr double kCornerPx = 160;  // side of the region where coma is looked for

/// Every texture of the scene with that part of its contrast left.
void ScaleContrast(sim::Scene& scene, double part) {
  for (sim::Surface& surface : scene.surfaces) {
    auto* paint = std::get_if<sim::TexturePaint>(&surface.paint);
    if (paint == nullptr) continue;
    auto faded = std::make_shared<sim::Texture>(*paint->texture);
    double sum = 0.0;
    for (const float light : faded->light) sum += static_cast<double>(light);
    const double mean = sum / static_cast<double>(faded->light.size());
    for (float& light : faded->light) light = static_cast<float>(mean + part * (static_cast<double>(light) - mean));
    paint->texture = std::move(faded);
  }
}

/// The first wall's vergence, in dioptres.
double WallVergence(const sim::Scene& scene) {
  const auto* plane = scene.surfaces.empty() ? nullptr : std::get_if<sim::PlaneShape>(&scene.surfaces.front().shape);
  return plane != nullptr ? plane->u0_d : 0.0;
}

/// Every run starts where the wall is blurred by so many pixels, beyond its focus, in a travel that is long enough.
void StartBlurred(sim::Scene& scene, AutofocusRuns& runs, double blur_px) {
  sim::LensSettings& lens = scene.lens;
  const double f_m = 1e-3 * lens.min_focal_length_mm, opening_m = f_m / lens.initial_f_number;
  const double image_m = 1.0 / (1.0 / f_m - WallVergence(scene));
  const double start_m = image_m + blur_px * scene.camera.pixel_um * 1e-6 * image_m / opening_m;
  const double step_mm = (lens.max_extension_mm - lens.min_extension_mm) / (lens.steps - 1.0);
  const double start_mm = 1e3 * (start_m - f_m);
  if (start_mm > lens.max_extension_mm) {
    const int more = static_cast<int>(std::ceil((start_mm - lens.max_extension_mm) / step_mm)) + 1;
    lens.steps += more;
    lens.max_extension_mm += more * step_mm;
  }
  runs.start = std::floor((start_mm - lens.min_extension_mm) / step_mm);
}

void ShrinkRegion(sim::Scene& scene, double side_px) {
  const double w = side_px / scene.camera.width, h = side_px / scene.camera.height;
  scene.truth_region = {0.5 - 0.5 * w, 0.5 - 0.5 * h, w, h};
}

void MoveSubject(sim::Scene& scene, double speed_m_per_s) {
  if (scene.surfaces.empty() || speed_m_per_s == 0.0) return;
  sim::Surface& wall = scene.surfaces.front();
  // Away at first, or towards the lens, at most half of the way.
  const double half_way_s = std::numbers::pi / (WallVergence(scene) * std::abs(speed_m_per_s));
  wall.sway_s = speed_m_per_s > 0 ? 10.0 : -std::min(10.0, half_way_s);
  wall.sway_m = speed_m_per_s * wall.sway_s / (2.0 * std::numbers::pi);  // so fast at most
}

void CoarseSteps(sim::Scene& scene, double steps) {
  const double slower = steps / scene.lens.steps;
  scene.lens.steps = static_cast<int>(steps);
  scene.lens.speed_steps_per_s *= slower;  // the same travel in the same time
  scene.lens.acceleration_steps_per_s2 *= slower;
}

void Spherical(sim::Scene& scene, AutofocusRuns&, double path_um) {
  scene.lens.spherical_um = path_um;
}

/// Seen in a corner: there is none in the middle.
void Coma(sim::Scene& scene, AutofocusRuns&, double path_um) {
  scene.lens.coma_um = path_um;
  const double w = kCornerPx / scene.camera.width, h = kCornerPx / scene.camera.height;
  scene.truth_region = {0.02, 0.02, w, h};
}

const std::vector<Variation>& Table() {
  using sim::Scene;
  static const std::vector<Variation> table = {
      {"light",
       "electrons that make white",
       {10000, 3000, 1000, 300, 100, 30, 10},
       [](Scene& scene, AutofocusRuns&, double value) { scene.camera.full_well_e = value; }},
      {"contrast",
       "contrast of the texture [part of its own]",
       {1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01},
       [](Scene& scene, AutofocusRuns&, double value) { ScaleContrast(scene, value); }},
      {"defocus", "blur where the search starts [px]", {2, 5, 10, 20, 40, 80, 160, 320}, StartBlurred},
      {"blades",
       "corners of the aperture, even [0: a circle]",
       {0, 8, 6, 4},
       [](Scene& scene, AutofocusRuns&, double value) { scene.lens.aperture_blades = static_cast<int>(value); }},
      {"f-number",
       "f-number believed over the true one",
       {1, 0.9, 1.1, 0.8, 1.25, 0.65, 1.5, 2, 4, 8},
       [](Scene&, AutofocusRuns& runs, double value) { runs.f_number_error = value; }},
      {"backlash",
       "backlash [steps of the motor]",
       {0, 30, 100, 400, 1000, 2000},
       [](Scene& scene, AutofocusRuns&, double value) { scene.lens.backlash_steps = value; }},
      {"latency",
       "readings of the lens are late by [ms]",
       {0, 10, 50, 100, 300, 1000},
       [](Scene&, AutofocusRuns& runs, double value) {
         runs.late = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(value));
       }},
      {"vibration",
       "sideways shake between frames [px, standard deviation]",
       {0, 1, 2, 4, 8, 16, 32, 64},
       [](Scene& scene, AutofocusRuns&, double value) { scene.camera.shake_px = value; }},
      {"subject-speed",
       "greatest speed of the subject [m/s]",
       {0, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3},
       [](Scene& scene, AutofocusRuns&, double value) { MoveSubject(scene, value); }},
      {"flicker",
       "flicker at 100 Hz [relative amplitude]",
       {0, 0.1, 0.2, 0.4, 0.8, 0.95},
       [](Scene& scene, AutofocusRuns&, double value) { scene.camera.flicker = value; }},
      {"window",
       "side of the region [px]",
       {200, 100, 60, 40, 20, 12, 8, 4, 2},
       [](Scene& scene, AutofocusRuns&, double value) { ShrinkRegion(scene, value); }},
      {"step",
       "positions of the motor over the travel",
       {4096, 1024, 256, 64, 32, 16, 8},
       [](Scene& scene, AutofocusRuns&, double value) { CoarseSteps(scene, value); }},
      {"spherical", "spherical aberration at the rim [um of optical path]", {0, 2, 4, 8, 16, 32}, Spherical, kFewRuns},
      {"coma", "coma at the frame's corners [um of optical path]", {0, 1, 2, 4, 8, 16}, Coma, kFewRuns}};
  return table;
}

}  // namespace

std::span<const Variation> Variations() {
  return Table();
}

const Variation* VariationNamed(std::string_view name) {
  const auto found = std::ranges::find(Table(), name, &Variation::name);
  return found == Table().end() ? nullptr : &*found;
}

Result<void> Vary(const std::string& asked, sim::Scene& scene, AutofocusRuns& runs) {
  const std::size_t equals = asked.find('=');
  const Variation* variation = VariationNamed(asked.substr(0, equals));
  char* end = nullptr;
  const double value = equals == std::string::npos ? 0.0 : std::strtod(asked.c_str() + equals + 1, &end);
  if (variation == nullptr || end == nullptr || *end != '\0' || end == asked.c_str() + equals + 1) {
    std::string names;
    for (const Variation& known : Variations()) names += (names.empty() ? "" : ", ") + std::string(known.name);
    return Fail(Code::InvalidArgument, "--vary " + asked + ": NAME=NUMBER, with one of " + names);
  }
  variation->apply(scene, runs, value);
  return {};
}

}  // namespace lensd::bench
