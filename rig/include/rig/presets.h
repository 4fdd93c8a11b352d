// Places worth coming back to: what the lens did there optically, so that it can do the same again although the steps
// for it may have changed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "rig/rig.h"

namespace lensd::rig {

/// One lens state under a label. Optical figures are there where they were known.
struct Preset {
  std::string label;
  std::string saved;  ///< when, for people
  std::optional<Celsius> temperature;
  bool approach_up = true;  ///< focus was approached moving toward larger positions
  drivers::PerAxis<std::optional<Native>> native;
  std::optional<Dioptres> vergence;  ///< of the plane in focus
  std::optional<Dioptres> vergence_bound;
  std::optional<Metres> extension;
  std::optional<FNumber> f_number;
  std::optional<Metres> focal_length;
  Grade grade = Grade::Uncalibrated;
};

/// Letters, digits, '-', '_', '.' and inner spaces, at most 64 of them.
bool IsPresetLabel(std::string_view label);

/// The lens as it stands. Busy: an axis moves. Disconnected: it does not answer.
Result<Preset> TakePreset(const Rig& rig, std::string label);

/// Presets file: version = 1, [[preset]]. BadData: "file:line: what is wrong".
Result<std::vector<Preset>> ReadPresets(const Settings& file);
std::string PresetsText(const std::vector<Preset>& presets);

struct RecallOutcome {
  std::vector<MoveOutcome> moves;
  bool reached = false;  ///< every axis is where the preset had it
  /// The plane in focus is within this of the one when the preset was saved.
  std::optional<Dioptres> vergence_bound;
  /// Without optics: focus is within this of where it was, in native units.
  std::optional<Native> native_bound;
  std::string remark;  ///< empty, or what the reader should know
};

/// Brings zoom, filter and iris back, then focus to the same plane as it is reached now: by today's calibration,
/// temperature and approach. Without optics focus goes to the same mechanical place, its count corrected by the
/// backlash where it is approached from the other side now. Errors as Rig::Move(). On the rig's thread.
void RecallPreset(Rig& rig, const Preset& preset, std::move_only_function<void(Result<RecallOutcome>)> done);

}  // namespace lensd::rig
