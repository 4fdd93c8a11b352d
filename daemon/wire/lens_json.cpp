// Lenses as the interface tells them: what List and Status say, from what drivers and rigs know.
#include "daemon/wire/lens_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "daemon/wire/json_values.h"
#include "planning/plan_causes.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using varlink::Json;

std::string_view ActivityName(rig::Activity::Kind kind) {
  switch (kind) {
    case rig::Activity::Kind::Idle:
      return "idle";
    case rig::Activity::Kind::Moving:
      return "moving";
    case rig::Activity::Kind::Homing:
      return "homing";
    case rig::Activity::Kind::Autofocus:
      return "autofocus";
    case rig::Activity::Kind::Backlash:
      return "backlash";
    case rig::Activity::Kind::Snapshot:
      return "snapshot";
  }
  return "idle";
}

Json MovedBy(const rig::AxisStatus& axis) {
  if (axis.moved_by_another) return "external";
  return axis.moved_by_us ? Json("lensd") : Json(nullptr);
}

constexpr std::array<std::string_view, 3> kOrigins = {"lens", "sensor", "front"};

Json MoveCauseName(rig::MoveCause cause) {
  static constexpr std::array<std::string_view, 13> kNames = {
      "",      "counted", "noFeedback", "positionUnknown", "backlash",  "missed", "external",
      "fault", "stalled", "late",       "noReference",     "focusLost", "notKept"};
  return TextOrNull(std::string(NameIn(kNames, cause)));
}

/// Of focus; all are null where nobody says.
void AddDirection(const rig::FocusDirection& direction, Json& axis) {
  static constexpr std::array<std::string_view, 4> kFrom = {"configured", "calibration", "seen", "driver"};
  const bool known = direction.direction.has_value();
  axis["direction"] = known ? Json(FocusDirectionName(*direction.direction)) : Json(nullptr);
  axis["directionFrom"] = known ? Json(NameIn(kFrom, direction.from)) : Json(nullptr);
  axis["directionBy"] = TextOrNull(direction.by);
}

Json AxesInfoJson(const rig::Rig& rig) {
  Json axes = Json::array();
  const rig::Status status = rig.GetStatus();
  for (const Axis axis : drivers::kAxes) {
    const auto& can = rig.lens().axes[axis];
    if (!can) continue;
    const auto& now = status.axes[axis];
    const auto [lowest, highest] = rig.SoftLimits(axis);
    axes.push_back({{"axis", drivers::AxisName(axis)},
                    {"unit", UnitName(can->unit)},
                    {"minimum", NativeJson(lowest.value)},
                    {"maximum", NativeJson(highest.value)},
                    {"resolution", NativeJson(can->resolution)},
                    {"feedback", drivers::FeedbackName(can->feedback)},
                    {"canHome", can->can_home},
                    {"needsHome", can->needs_home},
                    {"canStop", can->can_stop},
                    {"referenced", now && now->referenced ? Json(*now->referenced) : Json(nullptr)}});
    if (axis == Axis::Focus) AddDirection(status.direction, axes.back());
  }
  return axes;
}

Json OpticsJson(const rig::OpticsTable& table, const rig::RigConfig& config, const Planning& planning,
                const std::string& calibration_file) {
  const drivers::NominalOptics& optics = table.nominal();
  return {{"focalLengthMm", optics.focal_length_m * kMmPerMetre},
          {"fNumberMin", optics.min_f_number},
          {"fNumberMax", optics.max_f_number},
          {"extensionMinMm", planning.defaults.extensions.low.value * kMmPerMetre},
          {"extensionMaxMm", planning.defaults.extensions.high.value * kMmPerMetre},
          {"principalGapMm", config.scale.principal_gap.value * kMmPerMetre},
          {"pupilFactor", config.pupil_factor},
          {"distanceFrom", NameIn(kOrigins, config.scale.from)},
          {"sensorToleranceUm", planning.defaults.sensor_tolerance.value * kUmPerMetre},
          {"fNumberTolerance", planning.defaults.f_number_tolerance.value},
          {"focalLengthMaxMm",
           optics.max_focal_length_m > 0.0 ? Json(optics.max_focal_length_m * kMmPerMetre) : Json(nullptr)},
          {"focalLengthTolerance", config.focal_length_tolerance},
          {"grade", GradeName(table.grade())},
          {"calibrationErrorUm", Optional(table.error(), kUmPerMetre)},
          {"calibrationFile", calibration_file.empty() ? Json(nullptr) : Json(calibration_file)}};
}

Json CameraJson(const drivers::CameraCapabilities& camera) {
  const auto positive = [](double value) { return value > 0.0 ? varlink::NumberOrNull(value) : Json(nullptr); };
  return {{"driver", camera.driver},
          {"model", camera.model},
          {"serial", TextOrNull(camera.serial)},
          {"widthPx", camera.width},
          {"heightPx", camera.height},
          {"bits", camera.bits},
          {"pixelUm", positive(camera.pixel_um)},
          {"frameRateHz", positive(camera.frame_rate_hz)},
          {"colour", camera.colour}};
}

}  // namespace

std::string_view UnitName(drivers::NativeUnit unit) {
  return unit == drivers::NativeUnit::FNumber ? "fNumber" : drivers::NativeUnitName(unit);
}

std::string_view FocusDirectionName(drivers::Direction direction) {
  return direction == drivers::Direction::NearPositive ? "nearPositive" : "nearNegative";
}

Json TextOrNull(std::string text) {
  return text.empty() ? Json(nullptr) : Json(std::move(text));
}

std::optional<optics::DistanceFrom> OriginOf(const Json& parameters) {
  const Json* from = Given(parameters, "distanceFrom");
  if (from == nullptr) return std::nullopt;
  const auto* const found = std::ranges::find(kOrigins, from->get_ref<const std::string&>());
  return static_cast<optics::DistanceFrom>(found - kOrigins.begin());
}

std::string_view BacklashCauseName(rig::BacklashCause cause) {
  static constexpr std::array<std::string_view, 8> kNames = {"",         "notFocused", "noPeak", "noRoom",
                                                             "tooLarge", "unsteady",   "missed", "configured"};
  return NameIn(kNames, cause);
}

Json NativeJson(double value) {
  if (std::abs(value) < 1e15 && value == std::floor(value)) return static_cast<std::int64_t>(value);
  return varlink::NumberOrNull(value);
}

Json InfoJson(const std::string& name, const rig::Rig& rig, const rig::RigConfig& config, const Planning* planning,
              const std::string& calibration_file) {
  const drivers::Capabilities& lens = rig.lens();
  return {
      {"name", name},
      {"driver", lens.driver},
      {"model", lens.model},
      {"serial", TextOrNull(lens.serial)},
      {"axes", AxesInfoJson(rig)},
      {"optics", planning != nullptr ? OpticsJson(*rig.optics(), config, *planning, calibration_file) : Json(nullptr)},
      {"camera", rig.camera() ? CameraJson(*rig.camera()) : Json(nullptr)},
      {"leftOut", LeftOutJson(rig.findings())}};
}

Json LeftOutJson(const drivers::Findings& findings) {
  Json left_out = Json::array();
  for (const drivers::LeftOut& one : findings.left_out()) {
    left_out.push_back({{"part", one.part}, {"reason", one.reason}});
  }
  return left_out;
}

Json AbsentInfoJson(const std::string& name, std::string_view driver) {
  return {{"name", name},          {"driver", driver},  {"model", nullptr},  {"serial", nullptr},
          {"axes", Json::array()}, {"optics", nullptr}, {"camera", nullptr}, {"leftOut", Json::array()}};
}

/// Without the frames that came well, or nearly: a state that changes with each of them would be told all the time.
Json CountersJson(const rig::Status& status) {
  const drivers::Counters& counters = status.counters;
  return {{"framesLost", counters.frames_lost},      {"framesLate", counters.frames_late},
          {"packetsLost", counters.packets_lost},    {"packetsResent", counters.packets_resent},
          {"busErrors", counters.bus_errors},        {"temperaturesLeftOut", status.temperatures_left_out},
          {"framesDamaged", counters.frames_damaged}};
}

Json UnwrittenJson(std::string_view file, const rig::Unkept& unkept) {
  return {{"file", file}, {"sinceNs", unkept.since.time_since_epoch().count()}, {"reason", unkept.reason}};
}

Json StatusJson(const std::string& name, const rig::Status& status) {
  Json unwritten = Json::array();
  if (status.unkept) unwritten.push_back(UnwrittenJson("positions", *status.unkept));
  Json axes = Json::array();
  for (const Axis axis : drivers::kAxes) {
    const auto& now = status.axes[axis];
    if (!now) continue;
    axes.push_back({{"axis", drivers::AxisName(axis)},
                    {"position", NativeJson(now->position.value)},
                    {"target", NativeJson(now->target.value)},
                    {"moving", now->moving},
                    {"homed", now->homed},
                    {"lastKnown", now->last_known},
                    {"positionBound", now->homed ? NativeJson(now->bound.value) : Json(nullptr)},
                    {"movedBy", MovedBy(*now)},
                    {"fault", TextOrNull(now->fault)}});
    if (now->lost) axes.back()["positionUnknown"] = true;
  }
  return {{"name", name},
          {"connected", status.connected},
          {"error", status.problem.empty() ? Json(nullptr) : Json(status.problem)},
          {"holdUntilNs", status.held_until ? Json(status.held_until->time_since_epoch().count()) : Json(nullptr)},
          {"activity", ActivityName(status.activity.kind)},
          {"step", status.activity.step},
          {"stepsExpected", status.activity.of},
          {"axes", std::move(axes)},
          {"vergenceD", Optional(status.vergence)},
          {"vergenceBoundD", Optional(status.vergence_bound)},
          {"focalPlaneM", DistanceJson(status.vergence)},
          {"extensionMm", Optional(status.extension, kMmPerMetre)},
          {"fNumber", Optional(status.f_number)},
          {"fNumberBound", Optional(status.f_number_bound)},
          {"focalLengthMm", Optional(status.focal_length, kMmPerMetre)},
          {"centreShiftMm", status.optics ? Json(status.optics->centre_shift().value * kMmPerMetre) : Json(nullptr)},
          {"grade", status.optics ? Json(GradeName(status.grade)) : Json(nullptr)},
          {"calibrationErrorUm", Optional(status.extension_error, kUmPerMetre)},
          {"temperatureC", Optional(status.temperature)},
          {"temperatureFault", TextOrNull(status.temperature_fault)},
          {"counters", CountersJson(status)},
          {"unwritten", std::move(unwritten)}};
}

Json MoveJson(const std::string& name, const rig::MoveOutcome& outcome) {
  Json move{{"lens", name},
            {"axis", drivers::AxisName(outcome.axis)},
            {"reached", outcome.reached},
            {"settled", outcome.settled},
            {"verified", outcome.verified},
            {"position", NativeJson(outcome.position.value)},
            {"extensionMm", Optional(outcome.extension, kMmPerMetre)},
            {"positionBound", NativeJson(outcome.bound.value)},
            {"missed", outcome.missed},
            {"movedBy", outcome.moved_by_another ? "external" : "lensd"},
            {"cause", MoveCauseName(outcome.cause)},
            {"reason", TextOrNull(outcome.reason)},
            {"elapsedMs", Milliseconds(outcome.elapsed)}};
  if (outcome.reason.ends_with("backlash is not known")) {
    move["reason"] = outcome.reason + ": " + BacklashAdvice(name, outcome.axis);
  }
  if (outcome.kept) move["kept"] = *outcome.kept;
  if (outcome.axis == Axis::Focus) move["vergenceD"] = Optional(outcome.vergence);
  if (outcome.axis == Axis::Iris) move["fNumber"] = Optional(outcome.f_number);
  if (outcome.vergence_bound) move["vergenceBoundD"] = Optional(outcome.vergence_bound);
  if (outcome.focal_length) {
    move["focalLengthMm"] = Optional(outcome.focal_length, kMmPerMetre);
    move["focalLengthBoundMm"] = Optional(outcome.focal_length_bound, kMmPerMetre);
  }
  if (outcome.extension_bound) move["extensionBoundUm"] = Optional(outcome.extension_bound, kUmPerMetre);
  return move;
}

Json PresetJson(const rig::Preset& preset) {
  return {{"label", preset.label},
          {"saved", preset.saved},
          {"focusPosition", Optional(preset.native[Axis::Focus])},
          {"irisPosition", Optional(preset.native[Axis::Iris])},
          {"zoomPosition", Optional(preset.native[Axis::Zoom])},
          {"filterPosition", Optional(preset.native[Axis::Filter])},
          {"approachUp", preset.approach_up},
          {"vergenceD", Optional(preset.vergence)},
          {"vergenceBoundD", Optional(preset.vergence_bound)},
          {"focalPlaneM", DistanceJson(preset.vergence)},
          {"fNumber", Optional(preset.f_number)},
          {"focalLengthMm", Optional(preset.focal_length, kMmPerMetre)},
          {"temperatureC", Optional(preset.temperature)},
          {"grade", GradeName(preset.grade)}};
}

Json MoveProgressJson(Axis axis, const rig::AxisStatus& status) {
  return {{"axis", drivers::AxisName(axis)},
          {"position", NativeJson(status.position.value)},
          {"target", NativeJson(status.target.value)}};
}

Json FrameJson(const rig::LensedFrame& lensed) {
  const drivers::Frame& frame = lensed.frame;
  bool moving = false;
  Json axes = Json::array();
  for (const Axis axis : drivers::kAxes) {
    const auto& during = lensed.axes[axis];
    if (!during) continue;
    moving |= during->moving;
    axes.push_back({{"axis", AxisName(axis)},
                    {"position", NativeJson(0.5 * (during->lowest.value + during->highest.value))},
                    {"positionBound", varlink::NumberOrNull(during->bound.value)},
                    {"moving", during->moving}});
  }
  return {{"widthPx", frame.width},
          {"heightPx", frame.height},
          {"bits", frame.bits},
          {"gamma", frame.gamma},
          {"sequence", frame.sequence},
          {"exposureMs", Milliseconds(frame.exposure_end - frame.exposure_start)},
          {"exposureStartNs", frame.exposure_start.time_since_epoch().count()},
          {"exposureEndNs", frame.exposure_end.time_since_epoch().count()},
          {"extensionMm", Optional(lensed.extension, kMmPerMetre)},
          {"extensionBoundUm", Optional(lensed.extension_bound, kUmPerMetre)},
          {"fNumber", Optional(lensed.f_number)},
          {"fNumberBound", Optional(lensed.f_number_bound)},
          {"moving", moving},
          {"axes", std::move(axes)}};
}

std::string Wrap(std::string_view field, const std::string& json) {
  return "{\"" + std::string(field) + "\":" + json + "}";
}

const Json* Given(const Json& object, std::string_view key) {
  const auto found = object.find(key);
  return found == object.end() || found->is_null() ? nullptr : &*found;
}

}  // namespace lensd::daemon
