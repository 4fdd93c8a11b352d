// Calibrations and presets on disk.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "config.h"
#include "rig/calibration.h"
#include "rig/presets.h"

namespace lensd::daemon {

/// Where the calibration of a lens is kept: the file its configuration names, else NAME[-SERIAL].calibration.toml in
/// the state folder, else nowhere (empty).
std::string CalibrationFile(const LensConfig& config, const std::string& state, const std::string& serial);
/// NAME.presets.toml in the state folder; empty without one.
std::string PresetsFile(const LensConfig& config, const std::string& state);

/// Null where there is no such file. Io, BadData.
Result<std::shared_ptr<const rig::Calibration>> LoadCalibration(const std::string& file);
Result<std::vector<rig::Preset>> LoadPresets(const std::string& file);

/// Replaces the file, or removes it where `text` is empty; nothing where `file` is empty. On return that outlives a
/// crash. Io.
Result<void> Keep(const std::string& file, const std::string& text);

}  // namespace lensd::daemon
