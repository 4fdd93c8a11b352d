// What the rig says, as the interface's types.
#pragma once

#include <string>
#include <string_view>

#include "planning/planning.h"
#include "rig/backlash.h"
#include "rig/presets.h"
#include "rig/rig.h"
#include "varlink/json.h"

namespace lensd::daemon {

/// A field of an object; nullptr where it is absent or null, which mean the same.
const varlink::Json* Given(const varlink::Json& object, std::string_view key);

/// `json` as the only field of an object.
std::string Wrap(std::string_view field, const std::string& json);

/// What is absent is null and never "".
varlink::Json TextOrNull(std::string text);
/// Native positions are mostly whole steps: those read better without a decimal point.
varlink::Json NativeJson(double value);
/// One of Unit of io.lensd.Lens.
std::string_view UnitName(drivers::NativeUnit unit);
/// One of FocusDirection.
std::string_view FocusDirectionName(drivers::Direction direction);

/// Where distances of a call start, as its distanceFrom says.
std::optional<optics::DistanceFrom> OriginOf(const varlink::Json& parameters);
std::string_view BacklashCauseName(rig::BacklashCause cause);

/// LensInfo.
varlink::Json InfoJson(const std::string& name, const rig::Rig& rig, const rig::RigConfig& config,
                       const Planning* planning, const std::string& calibration_file);
/// LeftOut of the interface, each part that was.
varlink::Json LeftOutJson(const drivers::Findings& findings);
/// LensInfo of a lens that has not been there yet.
varlink::Json AbsentInfoJson(const std::string& name, std::string_view driver);
/// Counters of the interface.
varlink::Json CountersJson(const rig::Status& status);
/// Unwritten, of a file of this kind.
varlink::Json UnwrittenJson(std::string_view file, const rig::Unkept& unkept);
/// LensStatus without readAtNs: equal values mean that nothing changed.
varlink::Json StatusJson(const std::string& name, const rig::Status& status);
/// MoveResult.
varlink::Json MoveJson(const std::string& name, const rig::MoveOutcome& outcome);
/// A state under a label.
varlink::Json PresetJson(const rig::Preset& preset);
/// MoveProgress.
varlink::Json MoveProgressJson(drivers::Axis axis, const rig::AxisStatus& status);
/// AutofocusCause of a refusal.
std::string_view AutofocusCauseName(autofocus::Cause cause);
/// AutofocusResult.
varlink::Json AutofocusJson(const std::string& name, const rig::AutofocusOutcome& outcome);
/// A cause of AutofocusCause.
std::string_view AutofocusCauseName(autofocus::Cause cause);
/// AutofocusProgress.
varlink::Json AutofocusProgressJson(const rig::AutofocusProgress& progress);
/// AutofocusStep.
varlink::Json FrameWantedJson(const rig::FrameWanted& wanted);
/// FrameInfo.
varlink::Json FrameJson(const rig::LensedFrame& frame);

}  // namespace lensd::daemon
