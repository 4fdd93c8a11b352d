// Where the subjects of a scene truly are, for scoring. Nothing of the product reads it.
#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/scene/subjects.h"
#include "sim/world.h"

namespace lensd::sim {
namespace {

constexpr double kLeastShare = 0.05;

/// The vergence of `surface` at a point of the frame given in fractions; none where it does not reach.
std::optional<double> VergenceAt(const Surface& surface, double x, double y) {
  const Region& region = surface.region;
  if (x < region.x || x >= region.x + region.w || y < region.y || y >= region.y + region.h) return std::nullopt;
  if (const auto* plane = std::get_if<PlaneShape>(&surface.shape)) {
    return plane->u0_d + plane->ux_d * (2.0 * x - 1.0) + plane->uy_d * (2.0 * y - 1.0);
  }
  const DepthMap& map = *std::get<DepthMapShape>(surface.shape).depth;
  const auto column = std::min(static_cast<int>(x * map.width), map.width - 1);
  const auto row = std::min(static_cast<int>(y * map.height), map.height - 1);
  return 1.0 / map.depth_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(map.width) +
                           static_cast<std::size_t>(column)];
}

/// The vergence of the nearest surface at each pixel of the region of truth, in rising order.
std::vector<double> VergencesIn(const Scene& scene) {
  std::vector<double> vergences;
  const Region& region = scene.truth_region;
  const double width = scene.camera.width;
  const double height = scene.camera.height;
  for (double j = std::floor(region.y * height); j < (region.y + region.h) * height; ++j) {
    for (double i = std::floor(region.x * width); i < (region.x + region.w) * width; ++i) {
      std::optional<double> nearest;
      for (const Surface& surface : scene.surfaces) {
        const auto here = VergenceAt(surface, (i + 0.5) / width, (j + 0.5) / height);
        if (here && (!nearest || *here > *nearest)) nearest = here;
      }
      if (nearest) vergences.push_back(*nearest);
    }
  }
  for (const LightPoint& light : scene.lights) {
    if (vergences.empty()) vergences.push_back(1.0 / light.distance_m);
  }
  std::sort(vergences.begin(), vergences.end());
  return vergences;
}

/// Two pixels of blur at f-number N, focal length f and sensor distance Zs, as a step of vergence.
double VergenceOfBlur(double blur_m, double f_number, double focal_length_m, double sensor_distance_m) {
  return blur_m * f_number / (focal_length_m * sensor_distance_m);
}

}  // namespace

std::vector<SubjectDepth> SubjectsIn(const Scene& scene) {
  const std::vector<double> vergences = VergencesIn(scene);
  const LensSettings& lens = scene.lens;
  const double focal_length_m = lens.min_focal_length_mm * 1e-3;
  const double gap_d = VergenceOfBlur(scene.camera.pixel_um * 1e-6, lens.min_f_number, focal_length_m, focal_length_m);
  std::vector<SubjectDepth> subjects;
  const auto all = static_cast<double>(vergences.size());
  for (std::size_t begin = 0, end = 1; end <= vergences.size(); ++end) {
    if (end < vergences.size() && vergences[end] - vergences[end - 1] <= gap_d) continue;
    const double share = static_cast<double>(end - begin) / all;
    if (share >= kLeastShare) subjects.push_back({vergences[begin + (end - begin) / 2], share});
    begin = end;
  }
  if (subjects.empty() && !vergences.empty()) subjects.push_back({vergences[vergences.size() / 2], 1.0});
  // Pieces do not overlap, so that no two have the same vergence.
  std::sort(subjects.begin(), subjects.end(), [](const SubjectDepth& a, const SubjectDepth& b) {
    return a.share != b.share ? a.share > b.share : a.vergence_d < b.vergence_d;
  });
  return subjects;
}

double HalfDepthOfFieldD(const CameraSettings& camera, const TrueState& state) {
  return VergenceOfBlur(2.0 * camera.pixel_um * 1e-6, state.f_number, state.optics.focal_length_m,
                        state.optics.sensor_distance_m);
}

}  // namespace lensd::sim
