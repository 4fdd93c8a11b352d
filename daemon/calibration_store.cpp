#include "calibration_store.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>
#include <utility>

#include "io/atomic_file.h"
#include "io/toml.h"

namespace lensd::daemon {
namespace {

/// A serial number as a part of a file's name.
std::string Plain(std::string serial) {
  const auto harmless = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
  std::ranges::replace_if(serial, [&](char c) { return !harmless(static_cast<unsigned char>(c)); }, '_');
  return serial;
}

bool IsThere(const std::string& file) {
  std::error_code error;
  return !file.empty() && std::filesystem::exists(file, error);
}

}  // namespace

std::string CalibrationFile(const LensConfig& config, const std::string& state, const std::string& serial) {
  if (config.rig.calibration_path) return *config.rig.calibration_path;
  if (state.empty()) return "";
  const std::string whose = serial.empty() ? "" : "-" + Plain(serial);
  return (std::filesystem::path(state) / (config.name + whose + ".calibration.toml")).string();
}

std::string PresetsFile(const LensConfig& config, const std::string& state) {
  return state.empty() ? "" : (std::filesystem::path(state) / (config.name + ".presets.toml")).string();
}

Result<std::shared_ptr<const rig::Calibration>> LoadCalibration(const std::string& file) {
  if (!IsThere(file)) return nullptr;
  auto settings = io::ReadTomlFile(file);
  if (!settings) return PassOn(std::move(settings));
  auto calibration = rig::ReadCalibration(*settings);
  if (!calibration) return PassOn(std::move(calibration));
  return std::make_shared<const rig::Calibration>(*std::move(calibration));
}

Result<std::vector<rig::Preset>> LoadPresets(const std::string& file) {
  if (!IsThere(file)) return std::vector<rig::Preset>{};
  auto settings = io::ReadTomlFile(file);
  if (!settings) return PassOn(std::move(settings));
  return rig::ReadPresets(*settings);
}

Result<void> Keep(const std::string& file, const std::string& text) {
  if (file.empty()) return {};
  if (!text.empty()) return io::WriteFileAtomically(file, text);
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error) return Fail(Code::Io, file + ": cannot be removed: " + error.message());
  return {};
}

}  // namespace lensd::daemon
