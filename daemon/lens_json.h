// What the rig says, as the interface's types.
#pragma once

#include <string>
#include <string_view>

#include "planning.h"
#include "proto/json.h"
#include "rig/presets.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// A field of an object; nullptr where it is absent or null, which mean the same.
const proto::Json* Given(const proto::Json& object, std::string_view key);

/// `json` as the only field of an object.
std::string Wrap(std::string_view field, const std::string& json);

/// LensInfo.
proto::Json InfoJson(const std::string& name, const rig::Rig& rig, const rig::RigConfig& config,
                     const std::optional<Planning>& planning, const std::string& calibration_file);
/// LensInfo of a lens that has not been there yet.
proto::Json AbsentInfoJson(const std::string& name, std::string_view driver);
/// LensStatus without readAtMs: equal values mean that nothing changed.
proto::Json StatusJson(const std::string& name, const rig::Status& status);
/// MoveResult.
proto::Json MoveJson(const std::string& name, const rig::MoveOutcome& outcome);
/// A state under a label.
proto::Json PresetJson(const rig::Preset& preset);
/// MoveProgress.
proto::Json MoveProgressJson(drivers::Axis axis, const rig::AxisStatus& status);
/// AutofocusResult.
proto::Json AutofocusJson(const std::string& name, const rig::AutofocusOutcome& outcome);
/// AutofocusProgress.
proto::Json AutofocusProgressJson(const rig::AutofocusProgress& progress);
/// AutofocusStep.
proto::Json FrameWantedJson(const rig::FrameWanted& wanted);
/// FrameInfo.
proto::Json FrameJson(const rig::LensedFrame& frame);

/// The interface's error for a code.
std::string_view ErrorName(Code code);

}  // namespace lensd::daemon
