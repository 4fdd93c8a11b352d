// Calibration files of the state folder, found by lens, read at opening and written whole.
#include "daemon/state/lens_state_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>
#include <utility>

#include "io/atomic_file.h"
#include "io/checked_file.h"
#include "io/toml.h"

namespace lensd::daemon {
namespace {

/// A serial number as a part of a file's name.
std::string Plain(std::string serial) {
  const auto harmless = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
  std::ranges::replace_if(serial, [&](char c) { return !harmless(static_cast<unsigned char>(c)); }, '_');
  return serial;
}

/// NAME[-SERIAL] with this ending in the state folder; empty without one.
std::string FileOfDevice(const LensConfig& config, const std::string& state, const std::string& serial,
                         const std::string& ending) {
  if (state.empty()) return "";
  const std::string whose = serial.empty() ? "" : "-" + Plain(serial);
  return (std::filesystem::path(state) / (config.name + whose + ending)).string();
}

}  // namespace

Error Damaged(const std::string& file, const std::string& why) {
  const auto copy = io::KeepDamaged(file);
  const std::string kept = copy ? "the file is kept as " + *copy : "it cannot be kept: " + copy.error().message;
  return {Code::BadData, why + "; " + kept};
}

namespace {

/// A file that a person named may be a pipe or a device, and is read as what it is. Nothing: there is none yet.
Result<std::optional<std::string>> ReadNamedFile(const std::string& file) {
  std::error_code error;
  if (std::filesystem::status(file, error).type() == std::filesystem::file_type::not_found) return std::nullopt;
  auto text = io::ReadWholeFile(file);
  if (!text) return PassOn(text);
  return std::optional(*std::move(text));
}

/// A file edited by hand may be meant so: what parses holds. What does not is kept, since the next one written takes
/// its place.
template <class Content, class Read>
Result<Kept<Content>> Load(const std::string& file, Writer writer, const Read& read) {
  if (file.empty()) return Kept<Content>{};
  const auto text = writer == Writer::Lensd ? io::ReadKeptFile(file) : ReadNamedFile(file);
  if (text && !*text) return Kept<Content>{};
  auto settings = text ? io::ParseToml(**text, file) : PassOn(text);
  Result<Content> content = settings ? read(*settings) : Result<Content>(PassOn(settings));
  if (!content && content.error().code == Code::BadData) return PassOn(Damaged(file, content.error().message));
  if (!content) return PassOn(content);
  Kept<Content> kept{.content = *std::move(content)};
  const io::Integrity integrity = io::IntegrityOfLines(**text);
  if (integrity == io::Integrity::Changed || (integrity == io::Integrity::Unsigned && writer == Writer::Lensd)) {
    kept.warning = file + ": edited by hand since lensd wrote it";
  }
  return kept;
}

}  // namespace

std::string CalibrationFile(const LensConfig& config, const std::string& state, const std::string& serial) {
  if (config.rig.calibration_path) return *config.rig.calibration_path;
  return FileOfDevice(config, state, serial, ".calibration.toml");
}

std::string PresetsFile(const LensConfig& config, const std::string& state) {
  return state.empty() ? "" : (std::filesystem::path(state) / (config.name + ".presets.toml")).string();
}

std::string LastFile(const LensConfig& config, const std::string& state) {
  return state.empty() ? "" : (std::filesystem::path(state) / (config.name + ".last.toml")).string();
}

std::string RefocusFile(const LensConfig& config, const std::string& state) {
  return state.empty() ? "" : (std::filesystem::path(state) / (config.name + ".refocus.toml")).string();
}

std::string SlopeFile(const LensConfig& config, const std::string& state, const std::string& serial) {
  return FileOfDevice(config, state, serial, ".slope.toml");
}

std::string DirectionFile(const LensConfig& config, const std::string& state, const std::string& serial) {
  return FileOfDevice(config, state, serial, ".direction.toml");
}

Result<Kept<std::shared_ptr<const rig::Calibration>>> LoadCalibration(const std::string& file, Writer writer) {
  return Load<std::shared_ptr<const rig::Calibration>>(file, writer, [](const Settings& settings) {
    auto calibration = rig::ReadCalibration(settings);
    using Shared = std::shared_ptr<const rig::Calibration>;
    if (!calibration) return Result<Shared>(PassOn(calibration));
    return Result<Shared>(std::make_shared<const rig::Calibration>(*std::move(calibration)));
  });
}

Result<void> CheckNamedCalibration(const std::string& file) {
  const auto text = ReadNamedFile(file);
  if (!text) return PassOn(text);
  if (!*text) return {};
  const auto settings = io::ParseToml(**text, file);
  if (!settings) return PassOn(settings);
  if (auto calibration = rig::ReadCalibration(*settings); !calibration) return PassOn(calibration);
  return {};
}

Result<Kept<std::vector<rig::Preset>>> LoadPresets(const std::string& file) {
  return Load<std::vector<rig::Preset>>(file, Writer::Lensd,
                                        [](const Settings& settings) { return rig::ReadPresets(settings); });
}

Result<Kept<std::vector<rig::DriftSample>>> LoadFocusDrift(const std::string& file) {
  return Load<std::vector<rig::DriftSample>>(file, Writer::Lensd,
                                             [](const Settings& settings) { return rig::ReadFocusDrift(settings); });
}

Result<Kept<std::vector<rig::SlopeRun>>> LoadLearnedSlope(const std::string& file) {
  return Load<std::vector<rig::SlopeRun>>(file, Writer::Lensd,
                                          [](const Settings& settings) { return rig::ReadLearnedSlope(settings); });
}

Result<Kept<std::optional<drivers::Direction>>> LoadSeenDirection(const std::string& file) {
  using Seen = std::optional<drivers::Direction>;
  return Load<Seen>(file, Writer::Lensd, [](const Settings& settings) -> Result<Seen> {
    auto seen = rig::ReadSeenDirection(settings);
    if (!seen) return PassOn(seen);
    return *seen;
  });
}

Result<void> Keep(const std::string& file, const std::string& text) {
  if (file.empty()) return {};
  if (!text.empty()) return io::WriteFileAtomically(file, io::SignedLines(text));
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error) return Fail(Code::Io, file + ": cannot be removed: " + error.message());
  return {};
}

}  // namespace lensd::daemon
