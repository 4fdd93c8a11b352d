// Which of the names a lens may go by this camera knows.
#include <arv.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "aravis_lens.h"

namespace lensd::drivers::aravis {
namespace {

constexpr double kFloatSteps = 4096.0;  ///< positions of an axis of real numbers that states no increment

bool CanWrite(ArvCamera* camera, const std::string& feature) {
  const ArvGcAccessMode mode = arv_device_get_feature_access_mode(arv_camera_get_device(camera), feature.c_str());
  return mode == ARV_GC_ACCESS_MODE_RW || mode == ARV_GC_ACCESS_MODE_WO;
}

/// The name where the camera has it, else empty.
std::string IfThere(ArvCamera* camera, std::string_view feature) {
  return Has(camera, feature) ? std::string(feature) : "";
}

std::optional<double> NumberOf(ArvCamera* camera, std::string_view feature) {
  if (!Has(camera, feature)) return std::nullopt;
  const std::string name(feature);
  ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(camera), name.c_str());
  CallError error;
  const double value = ARV_IS_GC_INTEGER(node)
                           ? static_cast<double>(arv_camera_get_integer(camera, name.c_str(), error.out()))
                           : arv_camera_get_float(camera, name.c_str(), error.out());
  if (error || !std::isfinite(value)) return std::nullopt;
  return value;
}

Result<void> ReadLimits(ArvCamera* camera, const AxisCandidate& candidate, AxisFeature& axis) {
  CallError error, step_error;
  double low = 0.0, high = 0.0, step = 0.0;
  const char* name = axis.feature.c_str();
  if (axis.is_integer) {
    gint64 minimum = 0, maximum = 0;
    arv_camera_get_integer_bounds(camera, name, &minimum, &maximum, error.out());
    low = static_cast<double>(minimum);
    high = static_cast<double>(maximum);
    step = static_cast<double>(arv_camera_get_integer_increment(camera, name, step_error.out()));
  } else {
    arv_camera_get_float_bounds(camera, name, &low, &high, error.out());
    step = arv_camera_get_float_increment(camera, name, step_error.out());
  }
  if (error) return error.Why("asking for the limits of " + axis.feature);
  low = NumberOf(camera, candidate.minimum).value_or(low);
  high = NumberOf(camera, candidate.maximum).value_or(high);
  constexpr double kCredible = 1e12;
  if (!(low < high) || std::abs(low) > kCredible || std::abs(high) > kCredible) {
    return Fail(Code::Unsupported, axis.feature + " states no limits to move between");
  }
  axis.can.minimum = Native{low};
  axis.can.maximum = Native{high};
  // Where a node states none, Aravis says 1 for integers and the smallest number there is for reals.
  const bool stated = !step_error && std::isfinite(step) && step > 1e-9 * (high - low);
  if (stated && step > high - low) {
    return Fail(Code::Protocol, axis.feature + " has steps that are larger than its range");
  }
  axis.can.resolution = stated ? step : axis.is_integer ? 1.0 : (high - low) / kFloatSteps;
  return {};
}

/// Where it stands can be read.
Result<void> ReadOnce(ArvCamera* camera, const AxisFeature& axis) {
  CallError error;
  const double value = axis.is_integer
                           ? static_cast<double>(arv_camera_get_integer(camera, axis.feature.c_str(), error.out()))
                           : arv_camera_get_float(camera, axis.feature.c_str(), error.out());
  if (error) return error.Why("reading " + axis.feature);
  if (!std::isfinite(value)) return Fail(Code::Protocol, axis.feature + " reads as no number");
  return {};
}

bool Uninitialized(ArvCamera* camera, const std::string& status) {
  if (status.empty()) return false;
  CallError error;
  const char* entry = arv_camera_get_string(camera, status.c_str(), error.out());
  return entry != nullptr && !error && ConditionOf(entry) == Condition::NotInitialized;
}

Result<AxisFeature> Describe(ArvCamera* camera, const AxisCandidate& candidate, const LensFacts& lens,
                             const LensNames& names) {
  AxisFeature axis;
  axis.feature = candidate.feature;
  ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(camera), axis.feature.c_str());
  axis.is_integer = ARV_IS_GC_INTEGER(node) && !ARV_IS_GC_FLOAT(node);
  axis.status = names.status == "none" ? "" : IfThere(camera, candidate.status);
  axis.initialize = IfThere(camera, candidate.initialize);
  if (axis.initialize.empty() || !names.initialize.empty()) axis.initialize = lens.initialize;
  axis.can.unit = candidate.unit;
  axis.can.direction = candidate.direction;
  axis.can.feedback = names.feedback.value_or(candidate.feedback);
  axis.can.can_home = !axis.initialize.empty();
  axis.can.needs_home = axis.can.can_home && (Uninitialized(camera, axis.status) || Uninitialized(camera, lens.status));
  axis.can.can_stop = !lens.abort.empty();
  if (auto read = ReadLimits(camera, candidate, axis); !read) return PassOn(read);
  // One that waits for its first initialization need not be readable before.
  if (axis.can.needs_home) return axis;
  auto read = ReadOnce(camera, axis);
  if (!read && !CameraIsGone(read.error())) read = ReadOnce(camera, axis);
  if (!read) return PassOn(read);
  return axis;
}

/// A name from the configuration: what the table says of it, or what can be said of any.
AxisCandidate Overridden(Axis axis, const std::string& feature) {
  for (const AxisCandidate& known : AxisCandidates()) {
    if (known.axis == axis && known.feature == feature) return known;
  }
  AxisCandidate candidate;
  candidate.axis = axis;
  candidate.feature = feature;
  return candidate;
}

Result<void> FindAxis(ArvCamera* camera, Axis axis, const LensNames& names, LensFacts& lens) {
  const std::string& wanted = names.feature[axis];
  if (wanted == "none") return {};
  if (!wanted.empty()) {
    const std::string key = std::string(AxisName(axis)) + "_feature \"" + wanted + "\"";
    if (!Has(camera, wanted)) return Fail(Code::Unsupported, "this camera has no " + key);
    if (!CanWrite(camera, wanted)) return Fail(Code::Unsupported, "this camera does not let " + key + " be written");
    auto described = Describe(camera, Overridden(axis, wanted), lens, names);
    if (!described) return PassOn(described);
    lens.axes[axis] = *std::move(described);
    return {};
  }
  for (const AxisCandidate& candidate : AxisCandidates()) {
    const std::string feature(candidate.feature);
    if (candidate.axis != axis || !Has(camera, feature)) continue;
    if (!CanWrite(camera, feature)) {
      lens.findings.LeaveOut(AxisName(axis), {Code::Unsupported, feature + " can be read and not written"});
      continue;
    }
    // A feature without limits is there for a lens that is not.
    auto described = Describe(camera, candidate, lens, names);
    if (described) {
      lens.axes[axis] = *std::move(described);
      lens.findings.TakeBack(AxisName(axis));
      return {};
    }
    if (CameraIsGone(described.error())) return PassOn(described);
    lens.findings.LeaveOut(AxisName(axis), described.error());
  }
  return {};
}

/// The configured name, "none" for none, or the table's where the camera has it.
Result<std::string> Chosen(ArvCamera* camera, const std::string& configured, std::string_view usual, const char* key) {
  if (configured == "none") return std::string();
  if (configured.empty()) return IfThere(camera, usual);
  if (!Has(camera, configured)) {
    return Fail(Code::Unsupported, "this camera has no " + std::string(key) + " \"" + configured + "\"");
  }
  return configured;
}

Result<void> FindController(ArvCamera* camera, const LensNames& names, LensFacts& lens) {
  const auto there = [&](const ControllerCandidate& candidate) {
    return Has(camera, candidate.status) || Has(camera, candidate.initialize) || Has(camera, candidate.abort);
  };
  const auto candidates = ControllerCandidates();
  const auto found = std::ranges::find_if(candidates, there);
  const ControllerCandidate controller = found == candidates.end() ? ControllerCandidate{} : *found;
  auto status = Chosen(camera, names.status, controller.status, "status_feature");
  if (!status) return PassOn(status);
  auto initialize = Chosen(camera, names.initialize, controller.initialize, "initialize_feature");
  if (!initialize) return PassOn(initialize);
  auto abort = Chosen(camera, names.abort, controller.abort, "abort_feature");
  if (!abort) return PassOn(abort);
  lens.status = *status;
  lens.initialize = *initialize;
  lens.abort = *abort;
  lens.temperature = IfThere(camera, controller.temperature);
  const std::string model = IfThere(camera, controller.model);
  if (!model.empty()) {
    CallError error;
    const char* text = arv_camera_get_string(camera, model.c_str(), error.out());
    if (text != nullptr && !error) lens.model = text;
  }
  return {};
}

/// Each time the camera is opened.
Result<void> SelectController(ArvCamera* camera, const LensFacts& facts) {
  if (facts.controller.empty()) return {};
  CallError error;
  arv_camera_set_string(camera, facts.selector.c_str(), facts.controller.c_str(), error.out());
  return error.Check("selecting optic_controller \"" + facts.controller + "\"");
}

}  // namespace

bool LensFacts::any() const {
  return std::ranges::any_of(kAxes, [&](Axis axis) { return axes[axis].has_value(); });
}

Result<LensFacts> FindLens(ArvCamera* camera, const LensNames& names) {
  LensFacts lens;
  lens.selector = IfThere(camera, ControllerCandidates().front().selector);
  if (!names.controller.empty() && lens.selector.empty()) {
    return Fail(Code::Unsupported, "this camera has one optic controller at most; remove optic_controller");
  }
  lens.controller = names.controller;
  if (auto selected = SelectController(camera, lens); !selected) return PassOn(selected);
  if (auto found = FindController(camera, names, lens); !found) return PassOn(found);
  for (const Axis axis : kAxes) {
    if (auto found = FindAxis(camera, axis, names, lens); !found) return PassOn(found);
  }
  return lens;
}

}  // namespace lensd::drivers::aravis
