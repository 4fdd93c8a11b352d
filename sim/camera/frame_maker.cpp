// One exposure from lens state to samples: which pictures are gathered, how bright, how they sway, then the sensor.
#include "sim/camera/frame_maker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <variant>

#include "sim/camera/colour_focus.h"
#include "sim/camera/finish.h"
#include "sim/camera/noise.h"
#include "sim/camera/sensor.h"

namespace lensd::sim {
namespace {

constexpr double kWhite = 0.9;        // of full well at the initial f-number
constexpr double kFlickerHz = 100.0;  // lamps on 50 Hz mains
constexpr double kSmear_px = 1.0;     // of blur, above which one exposure is averaged from several lens states
constexpr int kMostStates = 8;

double Seconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}

/// The mean of 1 + a cos(w t) over the exposure.
double FlickerOver(double amplitude, Duration start, Duration length) {
  const double w = 2.0 * std::numbers::pi * kFlickerHz;
  const double begin = Seconds(start);
  const double end = Seconds(start + length);
  return 1.0 + amplitude * (std::sin(w * end) - std::sin(w * begin)) / (w * (end - begin));
}

/// Light gathered at `state` relative to the same scene at the initial f-number: as 1/(working f-number)^2. A pinhole
/// is lit as if its exposure made up for its size.
double GatheredBy(const LensSettings& lens, const TrueState& state) {
  if (lens.model == LensModel::Pinhole) return 1.0;
  const double working = state.optics.sensor_distance_m / state.optics.aperture_diameter_m;
  return (lens.initial_f_number / working) * (lens.initial_f_number / working);
}

/// The lens that blurs the wall where it stood at time 0 as this one blurs it where it is now. Blur in the picture goes
/// with Zs (1/f - U) - 1, so the sensor is moved instead of the wall; its size in the picture stays what it was.
OpticalState AsIfStill(const Scene& scene, const TrueState& state) {
  OpticalState optics = state.optics;
  if (state.sway_d == 0.0) return optics;
  const double power_d = 1.0 / optics.focal_length_m;
  const double then_d = std::get<PlaneShape>(scene.surfaces.front().shape).u0_d;
  const auto seen = [&](double vergence_d) { return vergence_d / (1.0 - optics.centre_shift_m * vergence_d); };
  optics.sensor_distance_m *= (power_d - seen(then_d + state.sway_d)) / (power_d - seen(then_d));
  return optics;
}

/// The picture moved sideways, between pixels by Catmull-Rom; beyond the border the border goes on.
void Displace(std::vector<float>& light, int width, int height, double dx, double dy) {
  const auto along = [](double at, std::array<float, 4>& weights) {
    const double whole = std::floor(at);
    const auto t = static_cast<float>(at - whole);
    weights = {((-0.5f * t + 1.0f) * t - 0.5f) * t, (1.5f * t - 2.5f) * t * t + 1.0f,
               ((-1.5f * t + 2.0f) * t + 0.5f) * t, (0.5f * t - 0.5f) * t * t};
    return static_cast<int>(whole) - 1;
  };
  std::array<float, 4> across{}, down{};
  const int left = along(dx, across);
  const int upper = along(dy, down);
  std::vector<float> moved(light.size());
  std::vector<float> row(static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    std::ranges::fill(row, 0.0f);
    for (int k = 0; k < 4; ++k) {
      const float* from = light.data() + static_cast<std::ptrdiff_t>(std::clamp(y + upper + k, 0, height - 1)) * width;
      for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] += down[static_cast<std::size_t>(k)] * from[x];
    }
    for (int x = 0; x < width; ++x) {
      float sum = 0.0f;
      for (int k = 0; k < 4; ++k) {
        sum +=
            across[static_cast<std::size_t>(k)] * row[static_cast<std::size_t>(std::clamp(x + left + k, 0, width - 1))];
      }
      moved[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          std::max(sum, 0.0f);
    }
  }
  light = std::move(moved);
}

void AddPicture(std::vector<float>& light, const Picture& picture, float weight) {
  const float unit = weight / 65535.0f;
  for (std::size_t i = 0; i < light.size(); ++i) light[i] += unit * static_cast<float>(picture.light[i]);
  for (const auto& bright : picture.bright) light[bright.index] += weight * (bright.light - 1.0f);
}

CameraSettings SettingsOf(CameraSettings camera, Sensor sensor) {
  if (sensor == Sensor::Real) return camera;
  camera.full_well_e.reset();  // no photons are counted
  camera.read_noise_e = 0.0;
  camera.shake_px = 0.0;
  camera.veil = 0.0;
  camera.flaws = {};
  camera.finish.jpeg_quality = 0;
  return camera;
}

/// Veiling glare: light that the lens scatters so widely that every pixel gets the same of it.
void Veil(std::vector<float>& light, double share) {
  double sum = 0.0;
  for (const float value : light) sum += static_cast<double>(value);
  const auto glare = static_cast<float>(share * sum / static_cast<double>(light.size()));
  for (float& value : light) value = static_cast<float>(1.0 - share) * value + glare;
}

std::vector<std::uint16_t> SamplesOf(const CameraSettings& camera, std::span<const float> light, float gain,
                                     std::uint64_t noise, float amplification) {
  if (!camera.finish.any()) return Expose(camera, light, gain, noise, amplification);
  CameraSettings deep = camera;
  deep.bits = 16;
  return Finished(camera, Expose(deep, light, gain, noise, amplification));
}

}  // namespace

FrameMaker::FrameMaker(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures, Sensor sensor,
                       std::uint64_t seed)
    : mechanics_(std::move(mechanics)),
      pictures_(std::move(pictures)),
      camera_(SettingsOf(mechanics_->scene().camera, sensor)),
      seed_(seed) {}

Shot FrameMaker::ShotOf(const Exposure& exposure) const {
  const Scene& scene = mechanics_->scene();
  Shot shot{.exposure = exposure, .length = exposure.length, .states = {}};
  if (const auto wrong = mechanics_->FaultAt(FaultKind::WrongExposure, exposure.start)) {
    shot.length = Duration(std::llround(static_cast<double>(exposure.length.count()) * wrong->factor));
  }
  shot.length = std::max(shot.length, Duration(1));
  double least_m = 1e9;
  double most_m = -1e9;
  for (int i = 0; i < kMostStates; ++i) {
    shot.states.push_back(mechanics_->StateAt(exposure.start + shot.length * (2 * i + 1) / (2 * kMostStates)));
    least_m = std::min(least_m, shot.states.back().extension_m);
    most_m = std::max(most_m, shot.states.back().extension_m);
  }
  // Blur changes by about this many pixels, by the aperture's angle from the sensor.
  const OpticalState& optics = shot.states.front().optics;
  const double smear_px =
      (most_m - least_m) * optics.aperture_diameter_m / optics.sensor_distance_m / (scene.camera.pixel_um * 1e-6);
  if (smear_px <= kSmear_px) shot.states = {mechanics_->StateAt(exposure.start + shot.length / 2)};
  return shot;
}

const SensorMap& FrameMaker::MapOf(Channel channel) {
  return maps_.try_emplace(channel, camera_, mechanics_->scene().lens.vignetting, channel).first->second;
}

Result<std::vector<std::uint16_t>> FrameMaker::Exposed(const Shot& shot, Channel channel, const std::stop_token& stop) {
  const Scene& scene = mechanics_->scene();
  const CameraSettings& camera = camera_;
  light_.assign(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0f);
  for (const TrueState& state : shot.states) {
    const double weight = GatheredBy(scene.lens, state) / static_cast<double>(shot.states.size());
    for (const ColourShare& colour : ColoursSeen(scene, channel)) {
      OpticalState optics = AsIfStill(scene, state);
      optics.sensor_distance_m -= colour.extension_m;
      auto picture = pictures_->At(optics, stop, channel);
      if (!picture) return PassOn(picture);
      AddPicture(light_, **picture, static_cast<float>(colour.share * weight));
    }
  }
  const double exposed = Seconds(shot.length) / (camera.exposure_ms * 1e-3);
  const double gain = kWhite * exposed * FlickerOver(camera.flicker, shot.exposure.start, shot.length);
  const std::uint64_t key = Mix(Mix(seed_) ^ shot.exposure.sequence);
  if (camera.shake_px > 0.0) {
    std::array<float, 2> off{};
    FillNormals(Mix(key), off);
    Displace(light_, camera.width, camera.height, camera.shake_px * off[0], camera.shake_px * off[1]);
  }
  if (camera.veil > 0.0) Veil(light_, camera.veil);
  MapOf(channel).Apply(light_, static_cast<float>(exposed / std::max(gain, 1e-9)));
  const std::uint64_t noise = channel == Channel::Luminance ? key : Mix(key ^ static_cast<std::uint64_t>(channel));
  return SamplesOf(camera, light_, static_cast<float>(gain), noise, static_cast<float>(shot.amplification));
}

Result<Samples> FrameMaker::Make(const Shot& shot, const std::stop_token& stop) {
  if (const auto& prepared = mechanics_->scene().frames; !prepared.empty()) {
    const PreparedFrame& frame = prepared[shot.exposure.sequence % prepared.size()];
    return Samples{frame.luminance, frame.colour};
  }
  using Values = std::vector<std::uint16_t>;
  const CameraSettings& camera = camera_;
  if (!camera.colour) {
    auto luminance = Exposed(shot, Channel::Luminance, stop);
    if (!luminance) return PassOn(luminance);
    return Samples{std::make_shared<const Values>(*std::move(luminance)), nullptr};
  }
  std::array<Values, 3> channels;
  for (const Channel channel : {Channel::Red, Channel::Green, Channel::Blue}) {
    auto exposed = Exposed(shot, channel, stop);
    if (!exposed) return PassOn(exposed);
    channels[static_cast<std::size_t>(channel) - 1] = *std::move(exposed);
  }
  Values colour;
  colour.reserve(3 * channels.front().size());
  for (std::size_t i = 0; i < channels.front().size(); ++i) {
    for (const Values& values : channels) colour.push_back(values[i]);
  }
  auto luminance = LuminanceOf(camera, channels);
  return Samples{std::make_shared<const Values>(std::move(luminance)),
                 std::make_shared<const Values>(std::move(colour))};
}

}  // namespace lensd::sim
