// The renderer's light, noise and rounding added here, and truths from the scene alone.
#include "scored_stack.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <stdexcept>

#include "io/png.h"
#include "sim/render.h"

namespace lensd::testing {
namespace {

template <class T>
T Must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}

sim::OpticalState StateAt(const sim::Scene& scene, const StackPlan& plan, double along, double vergence_d) {
  const double nominal = 1e-3 * scene.lens.min_focal_length_mm;
  sim::OpticalState state;
  state.focal_length_m = nominal * (1.0 + plan.breathing * along);
  state.aperture_diameter_m = nominal / plan.f_number;
  state.sensor_distance_m = 1.0 / (1.0 / state.focal_length_m - vergence_d);
  state.magnification = state.focal_length_m / nominal;
  return state;
}

double VergenceAt(const sim::Scene& scene, double x, double y) {
  double nearest = 0.0;
  for (const sim::Surface& surface : scene.surfaces) {
    const sim::Region& r = surface.region;
    if (x < r.x || y < r.y || x >= r.x + r.w || y >= r.y + r.h) continue;
    if (const auto* plane = std::get_if<sim::PlaneShape>(&surface.shape)) {
      nearest = std::max(nearest, plane->u0_d + plane->ux_d * (2 * x - 1) + plane->uy_d * (2 * y - 1));
      continue;
    }
    const sim::DepthMap& map = *std::get<sim::DepthMapShape>(surface.shape).depth;
    const auto i = static_cast<std::size_t>(std::clamp(static_cast<int>(x * map.width), 0, map.width - 1));
    const auto j = static_cast<std::size_t>(std::clamp(static_cast<int>(y * map.height), 0, map.height - 1));
    nearest = std::max(nearest, 1.0 / static_cast<double>(map.depth_m[j * static_cast<std::size_t>(map.width) + i]));
  }
  return nearest;
}

std::vector<float> TruthOf(const sim::Scene& scene, double magnification) {
  const int width = scene.camera.width, height = scene.camera.height;
  std::vector<float> truth;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = 0.5 + ((x + 0.5) / width - 0.5) / magnification,
                   v = 0.5 + ((y + 0.5) / height - 0.5) / magnification;
      truth.push_back(static_cast<float>(VergenceAt(scene, u, v)));
    }
  }
  return truth;
}

/// For every pixel the largest less the smallest of `plane` within `radius`.
std::vector<float> RangeAround(const std::vector<float>& plane, int width, int radius) {
  const int height = static_cast<int>(plane.size()) / width;
  std::vector<float> low(plane), high(plane);
  for (const bool along : {true, false}) {
    const auto from_low = low, from_high = high;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto i = static_cast<std::size_t>(y * width + x);
        for (int k = -radius; k <= radius; ++k) {
          const int u = std::clamp(along ? x + k : x, 0, width - 1), v = std::clamp(along ? y : y + k, 0, height - 1);
          low[i] = std::min(low[i], from_low[static_cast<std::size_t>(v * width + u)]);
          high[i] = std::max(high[i], from_high[static_cast<std::size_t>(v * width + u)]);
        }
      }
    }
  }
  for (std::size_t i = 0; i < low.size(); ++i) high[i] -= low[i];
  return high;
}

}  // namespace

ScoredStack RenderStack(const sim::Scene& scene, const StackPlan& plan) {
  const auto renderer = Must(sim::Renderer::Create(scene));
  ScoredStack stack;
  std::mt19937 random(7);
  double first_light = 0.0;
  for (int k = 0; k < plan.frames; ++k) {
    const double along = static_cast<double>(k) / (plan.frames - 1);
    const double vergence = plan.far_d + along * (plan.near_d - plan.far_d);
    const auto state = StateAt(scene, plan, along, vergence);
    const double light = plan.white * std::pow(1e-3 * scene.lens.min_focal_length_mm / state.sensor_distance_m, 2.0);
    if (k == 0) first_light = light;
    const auto rendered = Must(renderer.Render(state, {.tolerance = 2.0 / 255.0}));
    merge::Picture picture{rendered.image.width, rendered.image.height, 1, rendered.image.light};
    for (float& sample : picture.samples) {
      double electrons = static_cast<double>(sample) * light * plan.full_well_e;
      if (plan.read_noise_e > 0.0) {
        std::normal_distribution<double> noise(
            0.0, std::sqrt(std::max(0.0, electrons) + plan.read_noise_e * plan.read_noise_e));
        electrons += noise(random);
      }
      sample = static_cast<float>(std::round(std::clamp(electrons / plan.full_well_e, 0.0, 1.0) * 1023.0));
    }
    stack.frames.push_back(std::move(picture));
    stack.stations.push_back({vergence, state.magnification});
    if (k + 1 < plan.frames) continue;
    auto pinhole = state;
    pinhole.model = sim::LensModel::Pinhole;
    const auto sharp = Must(renderer.Render(pinhole, {}));
    stack.sharp = {sharp.image.width, sharp.image.height, 1, sharp.image.light};
    for (float& sample : stack.sharp.samples) sample *= static_cast<float>(1023.0 * first_light);
    stack.truth_d = TruthOf(scene, state.magnification);
    stack.half_depth_d = 2e-6 * scene.camera.pixel_um / (state.aperture_diameter_m * state.sensor_distance_m);
  }
  stack.frame_step_d = (plan.near_d - plan.far_d) / (plan.frames - 1);
  return stack;
}

DepthScore ScoreDepth(const ScoredStack& stack, const std::vector<float>& place, const std::vector<float>& sigma,
                      Part part) {
  const int width = stack.sharp.width, height = stack.sharp.height;
  const auto steps = RangeAround(stack.truth_d, width, 5);
  const auto contrast = RangeAround(stack.sharp.samples, width, 2);
  DepthScore score;
  double known = 0, within = 0, squares = 0, in_sigma = 0;
  for (int y = 8; y < height - 8; ++y) {
    for (int x = 8; x < width - 8; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      const bool edge = static_cast<double>(steps[i]) > stack.half_depth_d;
      if (contrast[i] < 0.1f * 1023.0f || edge != (part == Part::Edges)) continue;
      score.pixels += 1;
      if (std::isnan(place[i])) continue;
      const double off = std::abs(static_cast<double>(place[i] - stack.truth_d[i]));
      known += 1;
      within += off <= stack.half_depth_d ? 1 : 0;
      squares += off * off;
      if (!sigma.empty()) in_sigma += off <= 2.0 * static_cast<double>(sigma[i]) ? 1 : 0;
    }
  }
  score.known = known / score.pixels;
  score.within = within / known;
  score.rmse_d = std::sqrt(squares / known);
  score.within_2_sigma = in_sigma / known;
  return score;
}

double ScorePicture(const ScoredStack& stack, const merge::Picture& picture) {
  const int width = stack.sharp.width, height = stack.sharp.height;
  double cross = 0, power = 0, truth = 0, count = 0;
  for (int y = 8; y < height - 8; ++y) {
    for (int x = 8; x < width - 8; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      const auto a = static_cast<double>(picture.samples[i]), b = static_cast<double>(stack.sharp.samples[i]);
      cross += a * b;
      power += a * a;
      truth += b * b;
      count += 1;
    }
  }
  const double error = (truth - cross * cross / power) / count;  // with the gain that fits best
  return 10.0 * std::log10(1023.0 * 1023.0 / error);
}

Peer LaplacianPeer(const ScoredStack& stack) {
  const int width = stack.sharp.width, height = stack.sharp.height;
  Peer peer{std::vector<float>(stack.truth_d.size(), NAN),
            {width, height, 1, std::vector<float>(stack.truth_d.size())}};
  std::vector<double> best(stack.truth_d.size(), -1.0);
  constexpr int kRadius = 4;
  for (std::size_t k = 0; k < stack.frames.size(); ++k) {
    const auto& light = stack.frames[k].samples;
    std::vector<double> sums(static_cast<std::size_t>((width + 1) * (height + 1))), squares(sums);
    const auto at = [&](int x, int y) {
      return static_cast<double>(
          light[static_cast<std::size_t>(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1))]);
    };
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double l = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4.0 * at(x, y);
        const auto to = static_cast<std::size_t>((y + 1) * (width + 1) + x + 1),
                   up = to - static_cast<std::size_t>(width + 1);
        sums[to] = l + sums[to - 1] + sums[up] - sums[up - 1];
        squares[to] = l * l + squares[to - 1] + squares[up] - squares[up - 1];
      }
    }
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int l = std::max(0, x - kRadius), r = std::min(width, x + kRadius + 1);
        const int t = std::max(0, y - kRadius), b = std::min(height, y + kRadius + 1);
        const auto box = [&](const std::vector<double>& s) {
          const auto corner = [&](int u, int v) { return s[static_cast<std::size_t>(v * (width + 1) + u)]; };
          return (corner(r, b) - corner(l, b) - corner(r, t) + corner(l, t)) / ((r - l) * (b - t));
        };
        const double variance = box(squares) - box(sums) * box(sums);
        const auto i = static_cast<std::size_t>(y * width + x);
        if (variance <= best[i]) continue;
        best[i] = variance;
        peer.place[i] = static_cast<float>(stack.stations[k].place);
        peer.picture.samples[i] = light[i];
      }
    }
  }
  return peer;
}

void ShowPlane(const std::string& name, const std::vector<float>& plane, int width, float low, float high) {
  const char* folder = std::getenv("LENSD_TEST_PICTURES");
  if (folder == nullptr) return;
  io::Image image{width, static_cast<int>(plane.size()) / width, 1, 8, {}};
  for (const float value : plane) {
    const float share = std::isnan(value) ? 0.0f : std::clamp((value - low) / (high - low), 0.0f, 1.0f);
    image.samples.push_back(static_cast<std::uint16_t>(share * 255.0f));
  }
  if (!io::WritePng(std::string(folder) + "/" + name + ".png", image)) throw std::runtime_error(name);
}

sim::Scene TiltedScene() {
  auto scene = Must(sim::LoadScene(LENSD_SOURCE_DIR "/scenes/score/ground.toml"));
  scene.camera.width = 480;
  scene.camera.height = 360;
  scene.surfaces.front().shape = sim::PlaneShape{0.8, 0.2, 0.1};
  return scene;
}

sim::Scene WallsScene() {
  auto scene = Must(sim::LoadScene(LENSD_SOURCE_DIR "/scenes/score/ground.toml"));
  auto near = Must(sim::LoadScene(LENSD_SOURCE_DIR "/scenes/score/foliage.toml")).surfaces.front();
  scene.surfaces.front().shape = sim::PlaneShape{0.61};
  near.shape = sim::PlaneShape{0.99};
  near.region = {0.3, 0.25, 0.4, 0.5};
  scene.surfaces.push_back(near);
  return scene;
}

sim::Scene MotorcycleScene() {
  return Must(sim::LoadScene(LENSD_SOURCE_DIR "/scenes/motorcycle.toml"));
}

}  // namespace lensd::testing
