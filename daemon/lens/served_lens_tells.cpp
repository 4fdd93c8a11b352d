// What a lens tells of itself: its state, and what changed of it that is not the rig's to tell.
#include <utility>

#include "daemon/events/log.h"
#include "daemon/lens/served_lens.h"
#include "daemon/wire/lens_json.h"

namespace lensd::daemon {

using varlink::Json;

/// LensStatus as far as the worker's thread knows it, or the event loop's where there is no worker.
Json ServedLens::StateJson(const rig::Status& status) const {
  Json json = StatusJson(name(), status);
  const FileNotes& notes = shown_.notes;
  json["warnings"] = notes.warnings;
  for (const std::string& doubt : notes.devices.doubts()) json["warnings"].push_back(doubt);
  json["leftOut"] = LeftOutJson(notes.devices);
  if (std::string problem = users_->stay->problem(); !problem.empty()) json["warnings"].push_back(std::move(problem));
  if (!notes.of_calibration.empty()) json["warnings"].insert(json["warnings"].begin(), notes.of_calibration);
  if (!status.direction.warning.empty()) json["warnings"].push_back(status.direction.warning);
  if (notes.calibration_unkept) json["unwritten"].push_back(UnwrittenJson("calibration", *notes.calibration_unkept));
  if (config_.rig.temperature.compensate && status.optics && !status.compensates) {
    json["warnings"].push_back(
        "the temperature is not compensated, because no coefficient is known: give um_per_c in [lens.temperature], or "
        "a calibration with [temperature]");
  }
  if (config_.rig.refocus && status.connected) {
    const rig::RefocusMeans means{.thermometer = status.temperature.has_value(),
                                  .filter = status.axes[drivers::Axis::Filter].has_value(),
                                  .camera = status.has_camera};
    for (std::string& lacks : rig::WhatRefocusLacks(*config_.rig.refocus, means))
      json["warnings"].push_back(std::move(lacks));
  }
  return json;
}

/// LensStatus, serialised, with what is not part of the rig's state. From any thread.
std::string ServedLens::StatusText(Json json, std::string_view connection, const rig::Status& status) const {
  json["connection"] = connection;
  json["latched"] = users_->stops.latched();
  json["readAtNs"] = status.sampled_at.time_since_epoch().count();
  return varlink::WriteJson(json);
}

/// From now on this is the state: `text` is LensStatus but for the lease and the processes, which the rig does not
/// know.
void ServedLens::Show(std::shared_ptr<const rig::Status> status, std::string text, std::string_view connection) {
  shown_.connection = connection;
  shown_.status = std::move(status);
  shown_.rig = std::move(text);
  shown_.text = shown_.rig;
  shown_.text.back() = ',';
  shown_.text.append("\"lease\":").append(varlink::WriteJson(LeaseJson(users_->lease.now())));
  shown_.text.append(",").append(ProcessesText()).append("}");
}

std::string ServedLens::info() const {
  return shown_.info.substr(0, shown_.info.size() - 1) + "," + ProcessesText() + "}";
}

/// The two fields of feature "process", serialised.
std::string ServedLens::ProcessesText() const {
  const auto number = [this](const DeviceConfig* device) {
    const int process = device != nullptr && device->process && shown_.status->connected ? device->process->load() : 0;
    return process > 0 ? std::to_string(process) : "null";
  };
  return "\"process\":" + number(&config_.device) +
         ",\"cameraProcess\":" + number(config_.camera ? &*config_.camera : nullptr);
}

void ServedLens::ShowAbsent(std::string_view connection, std::string problem) {
  auto status = std::make_shared<rig::Status>();
  status->problem = std::move(problem);
  std::string text = StatusText(StateJson(*status), connection, *status);
  Show(std::move(status), std::move(text), connection);
}

/// The state is another one; whether the lens is there may be part of it.
void ServedLens::TellChange() {
  watchers().Tell(*this);
  if (shown_.told_connection == shown_.connection) return;
  shown_.told_connection = shown_.connection;
  watchers().Announce(*this, "list",
                      {{"change", shown_.connection == "connected" ? "opened" : "gone"},
                       {"connection", shown_.connection},
                       {"reason", TextOrNull(shown_.status->problem)}});
}

void ServedLens::TellLease(const Json& change) {
  Show(shown_.status, std::move(shown_.rig), std::string(shown_.connection));  // the state tells of it too
  watchers().Tell(*this);
  watchers().Announce(*this, "lease", change);
  users_->stay->Look();
}

/// What axes and the thermometer complain of now and did not before, and the other way round.
void ServedLens::TellFaults(const rig::Status& before) const {
  if (const std::string& fault = shown_.status->temperature_fault; fault != before.temperature_fault) {
    watchers().Announce(*this, "thermometer", {{"fault", TextOrNull(fault)}});
  }
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto& was = before.axes[axis];
    const auto& is = shown_.status->axes[axis];
    if (is && is->lost && !(was && was->lost)) {
      Log(Severity::Warning, Event::NotHomed, rig::WhyLost(axis, is)->message,
          {.lens = name(), .axis = drivers::AxisName(axis)});
    }
    if (!is || is->fault == (was ? was->fault : "")) continue;
    watchers().Announce(*this, "fault", {{"axis", drivers::AxisName(axis)}, {"fault", TextOrNull(is->fault)}});
  }
}

/// What its devices have and cannot use, once for each opening.
void ServedLens::TellLeftOut() const {
  for (const drivers::LeftOut& one : shown_.notes.devices.left_out()) {
    Log(Severity::Warning, Event::PartLeftOut, one.part + " is left out: " + one.reason,
        {.lens = name(), .axis = drivers::AxisFromName(one.part) ? one.part : std::string()});
  }
  for (const std::string& doubt : shown_.notes.devices.doubts()) {
    Log(Severity::Warning, Event::PartLeftOut, doubt, name());
  }
}

/// The disk does not take what is true, or does again.
void ServedLens::TellKept(std::string_view what, const std::optional<rig::Unkept>& unkept) const {
  if (!unkept)
    return Log(Severity::Info, Event::StateNotKept, std::string(what) + " on disk: up to date again", name());
  Log(Severity::Warning, Event::StateNotKept,
      std::string(what) + " on disk: out of date, lensd keeps trying to write: " + unkept->reason, name());
}

void ServedLens::TellCalibration(const Result<void>& kept) const {
  const auto& optics = shown_.status->optics;
  const auto error = optics ? optics->error() : std::nullopt;
  watchers().Announce(*this, "calibration",
                      {{"grade", GradeName(optics ? optics->grade() : rig::Grade::Uncalibrated)},
                       {"errorUm", error ? varlink::NumberOrNull(error->value * 1e6) : Json(nullptr)},
                       {"kept", kept.has_value()}});
}

}  // namespace lensd::daemon
