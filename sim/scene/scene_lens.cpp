// The camera, lens and fault sections of a scene file.
#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "sim/scene/scene_parts.h"

namespace lensd::sim {
namespace {

constexpr Range kFraction{0.0, 1.0};
constexpr double kMostPixels = 1 << 26;
/// In the order of FaultKind.
constexpr std::array<std::string_view, 13> kFaultKinds = {
    "stall",        "jump",           "disconnect",       "reconnect",   "drop-reply",
    "late-reply",   "stale-readback", "freeze-frames",    "lose-frames", "wrong-exposure",
    "missed-steps", "warmth",         "wrong-temperature"};

/// A number, or an array of two in rising order.
std::pair<double, double> ReadSpan(SettingsReader& read, std::string_view key, std::pair<double, double> fallback,
                                   Range range) {
  const Settings* found = read.Any(key);
  if (found == nullptr) return fallback;
  if (found->AsArray() == nullptr) {
    const double only = read.Number(key, fallback.first, range);
    return {only, only};
  }
  const auto ends = read.OptionalNumbers(key, 2, range);
  if (!ends) return fallback;
  if (ends->front() > ends->back()) read.Reject(key, "must be written from low to high");
  return {ends->front(), ends->back()};
}

void ReadNoise(SettingsReader& read, CameraSettings& camera) {
  camera.full_well_e = read.OptionalNumber("full_well_e", {1.0, 1e9});
  camera.read_noise_e = read.Number("read_noise_e", camera.read_noise_e, {0.0, 1e6});
  if (camera.read_noise_e > 0.0 && !camera.full_well_e) {
    read.Reject("read_noise_e", "needs full_well_e: without a full well, electrons cannot be turned into light");
  }
}

/// A wheel has two places or more.
void ReadWheel(SettingsReader& read, LensSettings& lens) {
  constexpr std::string_view kKey = "filter_focus_um";
  const auto* const places = read.Any(kKey)->AsArray();
  if (places == nullptr || places->size() < 2 || places->size() > 16) {
    return read.Reject(kKey, "is a list of 2 to 16 numbers, one for each place of the wheel");
  }
  if (auto shifts = read.OptionalNumbers(kKey, places->size(), {-1e4, 1e4})) lens.filter_focus_um = *std::move(shifts);
}

/// What render/pupil.h describes.
void ReadPupil(SettingsReader& read, LensSettings& lens) {
  constexpr Range kPath{-1e3, 1e3}, kShift{-1e4, 1e4};
  lens.obstruction = read.Number("obstruction", lens.obstruction, {0.0, 0.9});
  lens.cats_eye = read.Number("cats_eye", lens.cats_eye, {0.0, 0.9});
  lens.spherical_um = read.Number("spherical_um", lens.spherical_um, kPath);
  lens.coma_um = read.Number("coma_um", lens.coma_um, kPath);
  lens.focus_shift_um = read.Number("focus_shift_um", lens.focus_shift_um, kShift);
  lens.field_curvature_um = read.Number("field_curvature_um", lens.field_curvature_um, kShift);
  const auto pair = [&](std::string_view key, std::array<double, 2>& values) {
    if (const auto numbers = read.OptionalNumbers(key, 2, kShift)) values = {numbers->front(), numbers->back()};
  };
  pair("sensor_tilt_um", lens.sensor_tilt_um);
  pair("colour_focus_um", lens.colour_focus_um);
  if (read.Has("filter_focus_um")) ReadWheel(read, lens);
  lens.telecentric = read.Boolean("telecentric", lens.telecentric);
  for (const std::string_view key : {"obstruction", "cats_eye", "spherical_um", "coma_um", "field_curvature_um",
                                     "sensor_tilt_um", "colour_focus_um", "telecentric"}) {
    if (read.Has(key) && lens.model != LensModel::Thin) read.Reject(key, "is for a thin lens");
  }
}

void ReadFlaws(SettingsReader& read, SensorFlaws& flaws) {
  flaws.prnu = read.Number("prnu", flaws.prnu, {0.0, 0.2});
  flaws.hot_pixels = read.Number("hot_pixels", flaws.hot_pixels, {0.0, 0.1});
  flaws.dirt = static_cast<int>(read.Integer("dirt", flaws.dirt, {0, 10000}));
  flaws.dirt_px = read.Number("dirt_px", flaws.dirt_px, {1.0, 1000.0});
  flaws.dirt_loss = read.Number("dirt_loss", flaws.dirt_loss, kFraction);
  flaws.seed = static_cast<std::uint64_t>(read.Integer("flaw_seed", static_cast<long long>(flaws.seed), {0, 1e15}));
}

void ReadFinish(SettingsReader& read, CameraSettings& camera) {
  Finish& finish = camera.finish;
  finish.tone = read.Number("tone", finish.tone, kFraction);
  finish.sharpening = read.Number("sharpening", finish.sharpening, {0.0, 10.0});
  finish.jpeg_quality = static_cast<int>(read.Integer("jpeg_quality", finish.jpeg_quality, {0, 100}));
  if (finish.jpeg_quality > 0 && (camera.bits != 8 || camera.colour)) {
    read.Reject("jpeg_quality", "is for cameras of 8 bits without colour");
  }
}

void ReadMotion(SettingsReader& read, LensSettings& lens) {
  lens.steps = static_cast<int>(read.Integer("steps", lens.steps, {2, 1e8}));
  lens.speed_steps_per_s = read.Number("speed_steps_per_s", lens.speed_steps_per_s, {1e-3, 1e12});
  lens.acceleration_steps_per_s2 =
      read.Number("acceleration_steps_per_s2", lens.acceleration_steps_per_s2, {1e-3, 1e15});
  lens.settle_ms = read.Number("settle_ms", lens.settle_ms, {0.0, 1e6});
  lens.ring_hz = read.Number("ring_hz", lens.ring_hz, {0.0, 1e5});
  lens.ring_damping = read.Number("ring_damping", lens.ring_damping, {1e-4, 0.999});
  const std::vector<std::string_view> feedbacks(drivers::kFeedbackNames.begin(), drivers::kFeedbackNames.end());
  lens.feedback =
      static_cast<drivers::Feedback>(read.Choice("feedback", feedbacks, static_cast<std::size_t>(lens.feedback)));
  lens.reference = read.Boolean("reference", lens.reference);
  lens.backlash_steps = read.Number("backlash_steps", lens.backlash_steps, {0.0, 1e8});
  lens.iris_steps = static_cast<int>(read.Integer("iris_steps", lens.iris_steps, {2, 1e8}));
  lens.iris_backlash_steps = read.Number("iris_backlash_steps", lens.iris_backlash_steps, {0.0, 1e8});
}

void ReadOptics(SettingsReader& read, LensSettings& lens) {
  std::tie(lens.min_focal_length_mm, lens.max_focal_length_mm) =
      ReadSpan(read, "focal_length_mm", {lens.min_focal_length_mm, lens.max_focal_length_mm}, {0.01, 1e5});
  std::tie(lens.min_f_number, lens.max_f_number) =
      ReadSpan(read, "f_number", {lens.min_f_number, lens.max_f_number}, {0.1, 1e4});
  std::tie(lens.min_extension_mm, lens.max_extension_mm) =
      ReadSpan(read, "extension_mm", {lens.min_extension_mm, lens.max_extension_mm}, {-1e5, 1e6});
  if (lens.min_extension_mm >= lens.max_extension_mm) read.Reject("extension_mm", "must be a range [low, high]");
  if (lens.min_extension_mm <= -0.9 * lens.min_focal_length_mm) {
    read.Reject("extension_mm", "puts the sensor at the lens");
  }
  lens.centre_shift_mm = read.Number("centre_shift_mm", lens.centre_shift_mm, {-1e4, 1e4});
  if (lens.centre_shift_mm != 0.0 && !lens.zooms()) read.Reject("centre_shift_mm", "is for a lens that zooms");
  lens.liquid = read.Boolean("liquid", false);
  if (lens.liquid && (lens.zooms() || lens.model != LensModel::Thin || lens.breathing != 0.0)) {
    read.Reject("liquid", "is for a thin lens that neither zooms nor breathes");
  }
  if (lens.liquid && lens.max_extension_mm >= 0.9 * lens.min_focal_length_mm) {
    read.Reject("extension_mm", "must be well below the focal length of a liquid lens");
  }
  const double common = std::max(lens.min_f_number, std::min(lens.initial_f_number, lens.max_f_number));
  lens.initial_f_number = read.Number("initial_f_number", common, {lens.min_f_number, lens.max_f_number});
  lens.breathing = read.Number("breathing", lens.breathing, {-0.5, 0.5});
  lens.aperture_blades = static_cast<int>(read.Integer("aperture_blades", lens.aperture_blades, {0, 64}));
  if (lens.aperture_blades == 1 || lens.aperture_blades == 2) {
    read.Reject("aperture_blades", "must be at least 3, or 0 for a circle");
  }
  lens.vignetting = read.Number("vignetting", lens.vignetting, {0.0, 0.99});
  lens.temperature_c = read.Number("temperature_c", lens.temperature_c, {-273.15, 1000.0});
  lens.thermometer = read.Boolean("thermometer", lens.thermometer);
  lens.drift_um_per_c = read.Number("drift_um_per_c", lens.drift_um_per_c, {-1e4, 1e4});
}

}  // namespace

Result<CameraSettings> ReadCamera(const Settings* table) {
  CameraSettings camera;
  if (table == nullptr) return camera;
  SettingsReader read(*table, "[camera]");
  camera.width = static_cast<int>(read.Integer("width", camera.width, {1, 32768}));
  camera.height = static_cast<int>(read.Integer("height", camera.height, {1, 32768}));
  if (1.0 * camera.width * camera.height > kMostPixels) read.Reject("height", "makes a frame of more than 2^26 pixels");
  camera.pixel_um = read.Number("pixel_um", camera.pixel_um, {0.01, 1e5});
  camera.bits = static_cast<int>(read.Integer("bits", camera.bits, {8, 16}));
  if (camera.bits % 2 != 0 || camera.bits == 14) read.Reject("bits", "must be 8, 10, 12 or 16");
  camera.colour = read.Boolean("colour", camera.colour);
  ReadNoise(read, camera);
  camera.black_level = read.Number("black_level", camera.black_level, {0.0, 0.5});
  camera.exposure_ms = read.Number("exposure_ms", camera.exposure_ms, {1e-3, 1e5});
  camera.frame_rate_hz = read.Number("frame_rate_hz", camera.frame_rate_hz, {1e-3, 1e5});
  camera.flicker = read.Number("flicker", camera.flicker, kFraction);
  camera.gamma = read.Number("gamma", camera.gamma, {0.1, 10.0});
  camera.shake_px = read.Number("shake_px", camera.shake_px, {0.0, 100.0});
  camera.veil = read.Number("veil", camera.veil, kFraction);
  ReadFlaws(read, camera.flaws);
  ReadFinish(read, camera);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return camera;
}

Result<LensSettings> ReadLens(const Settings* table) {
  LensSettings lens;
  if (table == nullptr) return lens;
  SettingsReader read(*table, "[lens]");
  static constexpr LensModel kModels[] = {LensModel::Pinhole, LensModel::Aperture, LensModel::Thin};
  lens.model = kModels[read.Choice("model", {"pinhole", "aperture", "thin"}, 2)];
  ReadOptics(read, lens);
  ReadPupil(read, lens);
  ReadMotion(read, lens);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return lens;
}

std::optional<FaultKind> FaultKindFromName(std::string_view name) {
  const auto* const found = std::ranges::find(kFaultKinds, name);
  if (found == kFaultKinds.end()) return std::nullopt;
  return static_cast<FaultKind>(found - kFaultKinds.begin());
}

std::string FaultKindNames() {
  std::string names;
  for (const std::string_view kind : kFaultKinds) names += (names.empty() ? "" : ", ") + std::string(kind);
  return names;
}

Result<Fault> ReadFault(const Settings& table) {
  Fault fault;
  SettingsReader read(table, "[[fault]]");
  const std::vector<std::string_view> kinds(kFaultKinds.begin(), kFaultKinds.end());
  read.RequiredText("kind");
  fault.kind = static_cast<FaultKind>(read.Choice("kind", kinds, 0));
  fault.at_ms = read.RequiredNumber("at_ms", {0.0, 1e12});
  fault.for_ms = read.Number("for_ms", fault.for_ms, {0.0, 1e12});
  fault.steps = read.Number("steps", fault.steps, {-1e8, 1e8});
  fault.factor = read.Number("factor", fault.factor, {0.0, 1e3});
  fault.by_c = read.Number("by_c", fault.by_c, {-1e3, 1e3});
  static constexpr drivers::Axis kMotors[] = {drivers::Axis::Focus, drivers::Axis::Iris, drivers::Axis::Zoom};
  fault.axis = kMotors[read.Choice("axis", {"focus", "iris", "zoom"}, 0)];
  if (fault.kind == FaultKind::MissedSteps && fault.factor > 1.0) {
    read.Reject("factor", "is the part of each move that is lost: from 0 to 1");
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return fault;
}

}  // namespace lensd::sim
