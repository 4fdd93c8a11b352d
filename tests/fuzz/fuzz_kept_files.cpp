// Calibration and preset files, and those of what was learned of focus and blur. What is accepted can be written, read
// again and written the same; a checksum that was put on a text holds, and no longer does once a byte of the text has
// changed.
#include <string>
#include <string_view>

#include "io/checked_file.h"
#include "io/toml.h"
#include "rig/calibration.h"
#include "rig/focus_drift.h"
#include "rig/learned_slope.h"
#include "rig/presets.h"

namespace {

using namespace lensd;

void Calibration(std::string_view text) {
  const auto file = io::ParseToml(text, "fuzz");
  if (!file) return;
  const auto read = rig::ReadCalibration(*file);
  if (!read) return;
  const std::string written = rig::CalibrationText(*read);
  const auto reparsed = io::ParseToml(written, "written");
  if (!reparsed) __builtin_trap();
  const auto again = rig::ReadCalibration(*reparsed);
  if (!again || rig::CalibrationText(*again) != written) __builtin_trap();
}

void Presets(std::string_view text) {
  const auto file = io::ParseToml(text, "fuzz");
  if (!file) return;
  const auto read = rig::ReadPresets(*file);
  if (!read) return;
  const std::string written = rig::PresetsText(*read);
  const auto reparsed = io::ParseToml(written, "written");
  if (!reparsed) __builtin_trap();
  const auto again = rig::ReadPresets(*reparsed);
  if (!again || rig::PresetsText(*again) != written) __builtin_trap();
}

void Drift(std::string_view text) {
  const auto file = io::ParseToml(text, "fuzz");
  if (!file) return;
  auto read = rig::ReadFocusDrift(*file);
  if (!read) return;
  (void)rig::FitFocusDrift(*read);
  const std::string written = rig::FocusDriftText(*read);
  if (written.empty()) return;
  const auto reparsed = io::ParseToml(written, "written");
  if (!reparsed) __builtin_trap();
  const auto again = rig::ReadFocusDrift(*reparsed);
  if (!again || again->size() != read->size()) __builtin_trap();
}

void Slope(std::string_view text) {
  const auto file = io::ParseToml(text, "fuzz");
  if (!file) return;
  const auto read = rig::ReadLearnedSlope(*file);
  if (!read) return;
  const std::string written = rig::LearnedSlopeText(*read);
  if (written.empty()) return;
  const auto reparsed = io::ParseToml(written, "written");
  if (!reparsed) __builtin_trap();
  const auto again = rig::ReadLearnedSlope(*reparsed);
  if (!again || rig::LearnedSlopeText(*again) != written) __builtin_trap();
}

void Checksums(std::string_view text, std::size_t changed) {
  (void)io::IntegrityOfLines(text);
  (void)io::IntegrityOfObject(text);
  if (text.empty()) return;
  std::string lines = io::SignedLines(std::string(text));
  if (io::IntegrityOfLines(lines) != io::Integrity::Whole) __builtin_trap();
  lines[changed % text.size()] ^= 1;
  if (io::IntegrityOfLines(lines) == io::Integrity::Whole) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      Calibration(text);
      break;
    case 1:
      Presets(text);
      Drift(text);
      Slope(text);
      break;
    default:
      Checksums(text, data[0] / 3);
  }
  return 0;
}
