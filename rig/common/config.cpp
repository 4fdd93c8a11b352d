// One function a table of the section. Wrong values are named with their line; the driver's own keys are not read here.
#include "rig/config.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity_text.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

/// Two numbers, the smaller first.
std::optional<std::pair<double, double>> ReadRange(SettingsReader& read, std::string_view key, Range range) {
  const auto numbers = read.OptionalNumbers(key, 2, range);
  if (!numbers) return std::nullopt;
  if ((*numbers)[0] > (*numbers)[1]) {
    read.Reject(key, "must have its smaller number first");
    return std::nullopt;
  }
  return std::pair((*numbers)[0], (*numbers)[1]);
}

std::optional<double> ReadBacklash(SettingsReader& read) {
  const Settings* raw = read.Any("backlash");
  if (raw == nullptr) return std::nullopt;
  if (const auto* text = std::get_if<std::string>(&raw->value()); text != nullptr && *text == "auto") {
    return std::nullopt;
  }
  if (!raw->AsNumber()) read.Reject("backlash", "must be \"auto\" or a number of native units");
  return read.OptionalNumber("backlash", kNonNegative);
}

Duration Milliseconds(double ms) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms));
}

void ReadSettling(SettingsReader& read, AxisConfig& config) {
  const Settings* raw = read.Any("settle_ms");
  if (raw == nullptr) return;
  const auto* text = std::get_if<std::string>(&raw->value());
  config.settle_by_readback = text != nullptr && *text == "readback";
  if (config.settle_by_readback) return;
  if (!raw->AsNumber()) read.Reject("settle_ms", "must be \"readback\" or a number of milliseconds");
  if (const auto settle_ms = read.OptionalNumber("settle_ms", {0.0, 60e3})) config.settle = Milliseconds(*settle_ms);
}

void ReadShaper(SettingsReader& read, AxisConfig& config) {
  config.shaper = static_cast<Shaper>(read.Choice("shaper", {"none", "split", "zv", "zvd", "ramp"}, 0));
  config.ring_hz = read.Number("ring_hz", 0.0, {0.0, 1e5});
  config.ring_damping = read.Number("ring_damping", 0.0, {0.0, 0.99});
  if (config.shaper != Shaper::None && config.ring_hz <= 0.0) {
    read.Reject("ring_hz", "must be given, above 0, if there is a shaper");
  }
}

Result<AxisConfig> ReadAxis(const Settings& table, Axis axis) {
  SettingsReader read(table, "[lens." + std::string(AxisName(axis)) + "]");
  AxisConfig config;
  if (axis == Axis::Focus) {
    const std::vector<std::string_view> directions(drivers::kDirectionNames.begin(), drivers::kDirectionNames.end());
    if (read.Has("direction"))
      config.direction = static_cast<drivers::Direction>(read.Choice("direction", directions, 0));
    config.keep = read.Boolean("keep", false);
    if (read.Has("approach")) config.approach_near = read.Choice("approach", {"near", "far"}, 0) == 0;
  }
  config.backlash = ReadBacklash(read);
  ReadSettling(read, config);
  config.deadband = read.Number("deadband", 0.0, kNonNegative);
  config.retries = static_cast<int>(read.Integer("retries", config.retries, {0.0, 100.0}));
  config.repeatability = read.Number("repeatability", 0.0, kNonNegative);
  config.lost_travel = read.OptionalNumber("lost_travel", {0.0, 1.0});
  config.check_reference_every = read.OptionalNumber("check_reference_every", kPositive);
  config.sag = read.OptionalNumber("sag", kNonNegative);
  config.latency = Milliseconds(read.Number("latency_ms", 0.0, {0.0, 10e3}));
  config.restore = static_cast<Restore>(read.Choice("restore", {"never", "always", "near-zero", "conditional"}, 0));
  ReadShaper(read, config);
  config.tolerance = read.OptionalNumber("tolerance", kNonNegative);
  config.speed = read.OptionalNumber("speed", kPositive);
  if (const auto limits = ReadRange(read, "limits", {}))
    config.limits = {Native{limits->first}, Native{limits->second}};
  if (const auto park = read.OptionalNumber("park")) {
    config.park = Native{*park};
    const auto& limits = config.limits;
    if (limits && (*config.park < limits->first || *config.park > limits->second)) {
      read.Reject("park", "must be within limits");
    }
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

/// One focal length, or both ends of a zoom.
std::pair<double, double> ReadFocalLength(SettingsReader& read) {
  const Settings* raw = read.Any("focal_length_mm");
  if (raw != nullptr && raw->AsArray() != nullptr) {
    return ReadRange(read, "focal_length_mm", kPositive).value_or(std::pair(1.0, 1.0));
  }
  return {read.RequiredNumber("focal_length_mm", kPositive), 0.0};
}

Result<TemperatureConfig> ReadTemperature(const Settings& table) {
  SettingsReader read(table, "[lens.temperature]");
  TemperatureConfig config;
  config.compensate = read.Boolean("compensate", false);
  if (const auto um = read.OptionalNumber("um_per_c", {-1e4, 1e4})) config.metres_per_degree = Metres{*um * 1e-6};
  if (const auto at = read.OptionalNumber("reference_c", {-273.15, 1e3})) config.reference = Celsius{*at};
  config.minimum_move = read.Number("minimum_move", config.minimum_move, kPositive);
  if (const auto range = ReadRange(read, "range_c", {-273.15, 1e3})) {
    config.range = {Celsius{range->first}, Celsius{range->second}};
  }
  config.most_per_minute = read.Number("max_c_per_min", config.most_per_minute, {1e-3, 1e6});
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

Duration Seconds(double seconds) {
  return Milliseconds(1e3 * seconds);
}

Result<RefocusConfig> ReadRefocus(const Settings& table) {
  constexpr Range kAWeek{1.0, 604800.0};
  SettingsReader read(table, "[lens.refocus]");
  RefocusConfig config;
  if (const auto every = read.OptionalNumber("every_s", kAWeek)) config.every = Seconds(*every);
  if (const auto by = read.OptionalNumber("temperature_c", {0.1, 1e3})) config.temperature = Celsius{*by};
  config.filter = static_cast<RefocusConfig::OnFilter>(read.Choice("filter", {"ignore", "shift", "search"}, 0));
  config.sharpness_loss = read.OptionalNumber("sharpness_loss", {0.05, 0.95});
  config.look_every = Seconds(read.Number("look_every_s", 10.0, {0.1, 3600.0}));
  config.minimum_interval = Seconds(read.Number("minimum_interval_s", 60.0, kAWeek));
  if (const auto um = read.OptionalNumber("move_within_um", kPositive)) config.move_within = Metres{*um * 1e-6};
  if (!config.every && !config.temperature && config.filter == RefocusConfig::OnFilter::Ignore &&
      !config.sharpness_loss) {
    read.Reject("", "says nothing that starts a refocus: every_s, temperature_c, filter or sharpness_loss");
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return config;
}

/// Of a liquid lens: the extensions, sensor distance minus focal length, at the ends of its power.
std::optional<std::pair<double, double>> ReadPower(SettingsReader& read, double sensor_mm) {
  const auto power_d = ReadRange(read, "power_d", kPositive);
  if (!power_d) {
    read.Reject("power_d",
                "must be the power of the whole lens at both ends of focus, as in [38, 48]; or give closest_m");
    return std::nullopt;
  }
  return std::pair(sensor_mm - 1e3 / power_d->first, sensor_mm - 1e3 / power_d->second);
}

/// The focal length that a lens focuses nearest with: of a zoom the longest one.
double LongestMm(const std::pair<double, double>& focal_length_mm) {
  return std::max(focal_length_mm.first, focal_length_mm.second);
}

/// The extension, in mm, of a thin lens that focuses at `closest`: f^2/(Z_o - f) with Z_o from the lens centre. Of a
/// liquid lens, with its sensor at Z_s: Z_s^2/(Z_s + Z_o). OutOfRange: nearer than any lens focuses.
Result<double> NearExtensionMm(const optics::FocusScale& scale, double focal_length_mm, bool liquid, Metres closest) {
  constexpr double kRounding = 1e-9;       // what four focal lengths may lack
  constexpr double kLargestPicture = 100;  // times its object: nearer to the focal length no lens is built
  const Metres f{focal_length_mm * 1e-3};
  const auto depth = liquid ? optics::DepthAt(scale, f, Metres{0.0}, closest) : optics::DepthInFocus(scale, f, closest);
  const double least = 4.0 * f.value + scale.principal_gap.value;  // from the sensor, where the picture is 1:1
  const bool at_sensor = scale.from == optics::DistanceFrom::Sensor && !liquid;
  if (!depth && at_sensor && closest.value >= (1.0 - kRounding) * least) return focal_length_mm;
  if (!depth) return PassOn(depth);
  const double z = depth->distance().value_or(Metres{0.0}).value;
  if (liquid) return 1e3 * f.value * f.value / (f.value + z);
  if (!(z >= (1.0 + 1.0 / kLargestPicture) * f.value)) {
    return Fail(Code::OutOfRange, "it is within the focal length, or within 1 % of it, where no lens focuses");
  }
  return 1e3 * f.value * f.value / (z - f.value);
}

/// From infinity to the closest distance, as data sheets have it. Nothing: not given, or rejected.
std::optional<std::pair<double, double>> ReadClosest(SettingsReader& read, const optics::FocusScale& lens_scale,
                                                     double focal_length_mm, bool liquid) {
  const std::vector<std::string_view> kOrigins = {"lens", "sensor", "front"};
  optics::FocusScale scale = lens_scale;
  if (read.Has("closest_from")) {
    scale.from = static_cast<optics::DistanceFrom>(read.Choice("closest_from", kOrigins, 0));
  }
  const auto closest = read.OptionalNumber("closest_m", kPositive);
  if (!closest && read.Has("closest_from") && (read.Any("extension_mm") != nullptr || read.Any("power_d") != nullptr)) {
    read.Reject("closest_from", "says where closest_m starts, and there is no closest_m: leave closest_from out");
  }
  if (!closest) return std::nullopt;
  const char* other = liquid ? "power_d" : "extension_mm";
  if (read.Any(other) != nullptr) {
    read.Reject("closest_m", std::string("says the same as ") + other + ": give one of the two");
    return std::nullopt;
  }
  const auto near = NearExtensionMm(scale, focal_length_mm, liquid, Metres{*closest});
  if (near) return std::pair(0.0, *near);
  read.Reject("closest_m", "does not fit the focal length of " + LengthText(Metres{focal_length_mm * 1e-3}, 6) + ": " +
                               near.error().message + "; closest_from says where closest_m starts");
  return std::nullopt;
}

/// What a lens is by its data sheet: all of it, or nothing of it.
std::optional<drivers::NominalOptics> ReadNominal(SettingsReader& read, NominalFrom nominal,
                                                  const optics::FocusScale& scale) {
  constexpr const char* kKeys[] = {"focal_length_mm", "f_number",        "liquid",    "extension_mm",
                                   "power_d",         "centre_shift_mm", "closest_m", "closest_from"};
  const bool given = std::ranges::any_of(kKeys, [&](const char* key) { return read.Any(key) != nullptr; });
  if (!given && nominal == NominalFrom::Driver) return std::nullopt;
  const auto focal_length_mm = ReadFocalLength(read);
  const auto f_number = ReadRange(read, "f_number", kPositive);
  const bool liquid = read.Boolean("liquid", false);
  auto extension_mm = ReadClosest(read, scale, LongestMm(focal_length_mm), liquid);
  const bool closest = read.Has("closest_m");
  if (!closest) extension_mm = liquid ? ReadPower(read, focal_length_mm.first) : ReadRange(read, "extension_mm", {});
  const double centre_shift_mm = read.Number("centre_shift_mm", 0.0, {-1e4, 1e4});
  if (centre_shift_mm != 0.0 && !(focal_length_mm.second > focal_length_mm.first)) {
    read.Reject("centre_shift_mm", "is for a zoom: give focal_length_mm as [shortest, longest]");
  }
  if (!f_number) read.Reject("f_number", "must be the widest and the smallest opening, as in [1.8, 16]");
  if (!extension_mm && !liquid && !closest) {
    read.Reject(
        "closest_m",
        "must be the closest distance in focus, in metres, as in 0.3; or give extension_mm, the extension at both "
        "ends of focus, as in [0.0, 1.6] (docs/lenses.md)");
  }
  if (!f_number || !extension_mm) return std::nullopt;
  return drivers::NominalOptics{.focal_length_m = focal_length_mm.first * 1e-3,
                                .max_focal_length_m = focal_length_mm.second * 1e-3,
                                .centre_shift_m = centre_shift_mm * 1e-3,
                                .min_f_number = f_number->first,
                                .max_f_number = f_number->second,
                                .min_extension_m = extension_mm->first * 1e-3,
                                .max_extension_m = extension_mm->second * 1e-3,
                                .liquid = liquid};
}

Result<void> ReadOptics(const Settings& table, NominalFrom nominal, RigConfig& config) {
  SettingsReader read(table, "[lens.optics]");
  config.scale.principal_gap = Metres{read.Number("principal_gap_mm", 0.0, kNonNegative) * 1e-3};
  config.optics = ReadNominal(read, nominal, config.scale);
  config.focal_length_tolerance = read.Number("focal_length_tolerance_percent", 0.0, {0.0, 20.0}) * 1e-2;
  if (const auto nm = read.OptionalNumber("wavelength_nm", kPositive)) config.wavelength = Metres{*nm * 1e-9};
  config.calibration_path = read.OptionalPath("calibration");
  config.pupil_factor = read.Number("pupil_factor", 1.0, kPositive);
  config.use_learned_slope = read.Boolean("use_learned_slope", true);
  return read.Finish();
}

}  // namespace

Result<RigConfig> ReadRigConfig(SettingsReader& lens, NominalFrom nominal) {
  RigConfig config;
  Result<void> first;  // that failed; the other tables are read too, and tell their own mistakes
  const auto keep = [&](const auto& read) {
    if (!read && first) first = PassOn(read);
    return read.has_value();
  };
  config.scale.from = static_cast<optics::DistanceFrom>(lens.Choice("distance_from", {"lens", "sensor", "front"}, 0));
  if (const Settings* table = lens.Table("optics")) keep(ReadOptics(*table, nominal, config));
  if (const Settings* table = lens.Table("temperature")) {
    if (const auto read = ReadTemperature(*table); keep(read)) config.temperature = *read;
  }
  if (const Settings* table = lens.Table("refocus")) {
    if (const auto read = ReadRefocus(*table); keep(read)) config.refocus = *read;
  }
  for (const Axis axis : drivers::kAxes) {
    const Settings* table = lens.Table(AxisName(axis));
    if (table == nullptr) continue;
    if (const auto read = ReadAxis(*table, axis); keep(read)) config.axes[axis] = *read;
  }
  if (!first) return PassOn(first);
  return config;
}

std::string WhyFocusIsNotKept(const drivers::Capabilities& lens) {
  const auto& focus = lens.axes[Axis::Focus];
  if (!focus) return "keep: this lens has no motorised focus";
  if (focus->feedback != drivers::Feedback::None) return "";
  return "keep: the position of focus cannot be read back from this device, so that lensd cannot notice that another "
         "program has moved it";
}

}  // namespace lensd::rig
