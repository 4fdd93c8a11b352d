// Calibrations, presets and what was learned, on disk.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/config/config.h"
#include "rig/calibration.h"
#include "rig/direction.h"
#include "rig/focus_drift.h"
#include "rig/learned_slope.h"
#include "rig/presets.h"

namespace lensd::daemon {

/// Where the calibration of a lens is kept: the file its configuration names, else NAME[-SERIAL].calibration.toml in
/// the state folder, else nowhere (empty).
std::string CalibrationFile(const LensConfig& config, const std::string& state, const std::string& serial);
/// NAME.presets.toml in the state folder; empty without one.
std::string PresetsFile(const LensConfig& config, const std::string& state);

/// NAME.last.toml there: one preset, where the lens was left.
std::string LastFile(const LensConfig& config, const std::string& state);
/// NAME.refocus.toml there.
std::string RefocusFile(const LensConfig& config, const std::string& state);
/// NAME[-SERIAL].slope.toml there.
std::string SlopeFile(const LensConfig& config, const std::string& state, const std::string& serial);

/// NAME[-SERIAL].direction.toml there.
std::string DirectionFile(const LensConfig& config, const std::string& state, const std::string& serial);

/// What a kept file holds, and what its reader should know of it.
template <class Content>
struct Kept {
  Content content{};
  std::string warning{};  ///< empty, or that it was edited by hand
};

/// Who writes a file: one of the state folder has a checksum.
enum class Writer { Lensd, People };

/// Keeps a copy of a file that cannot be used; the error says so after `why`.
Error Damaged(const std::string& file, const std::string& why);

/// Null where there is no such file. Io, BadData: then a copy is kept as FILE.damaged, and the message says so.
Result<Kept<std::shared_ptr<const rig::Calibration>>> LoadCalibration(const std::string& file, Writer writer);
/// Whether a calibration that a person named would be read: nothing is kept of one that would not. No such file is
/// fine.
Result<void> CheckNamedCalibration(const std::string& file);
Result<Kept<std::vector<rig::Preset>>> LoadPresets(const std::string& file);
Result<Kept<std::vector<rig::DriftSample>>> LoadFocusDrift(const std::string& file);
Result<Kept<std::vector<rig::SlopeRun>>> LoadLearnedSlope(const std::string& file);
Result<Kept<std::optional<drivers::Direction>>> LoadSeenDirection(const std::string& file);

/// Replaces the file by `text` with a checksum, or removes it where `text` is empty; nothing where `file` is empty. On
/// return that outlives a crash. Io.
Result<void> Keep(const std::string& file, const std::string& text);

}  // namespace lensd::daemon
