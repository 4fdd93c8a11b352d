// Calibration and preset files, and those of what was learned of focus and blur. What is accepted can be written, read
// again and written the same, and what a calibration says of positions can be asked of it; a checksum that was put on a
// text holds, and no longer does once a byte of the text has changed.
#include <memory>
#include <string>
#include <string_view>

#include "io/checked_file.h"
#include "io/toml.h"
#include "rig/calibration.h"
#include "rig/focus_drift.h"
#include "rig/learned_slope.h"
#include "rig/optics_table.h"
#include "rig/presets.h"

namespace {

using namespace lensd;

/// As a lens with focus, iris and zoom asks for every move and every status.
void AskAll(const rig::Calibration& calibration) {
  using drivers::Axis;
  const drivers::NominalOptics nominal{.focal_length_m = 8e-3,
                                       .max_focal_length_m = 50e-3,
                                       .min_f_number = 1.4,
                                       .max_f_number = 16,
                                       .max_extension_m = 2e-3};
  drivers::Capabilities lens;
  constexpr double kSteps = 1000.0;
  for (const Axis axis : {Axis::Focus, Axis::Iris, Axis::Zoom}) {
    lens.axes[axis] = drivers::AxisCapabilities{.minimum = Native{0.0}, .maximum = Native{kSteps}};
  }
  const auto table =
      rig::OpticsTable::Create(nominal, lens, rig::RigConfig{}, std::make_shared<const rig::Calibration>(calibration));
  if (!table) return;
  for (const double steps : {0.0, 1.0, 450.5, kSteps}) {
    const Native at{steps};
    const rig::OpticsTable zoomed = table->In({.zoom = at, .filter = {}, .temperature = {}});
    const Metres extension = zoomed.ExtensionFromNative(at);
    (void)zoomed.NativeFromExtension(extension);
    (void)zoomed.VergenceFromExtension(extension);
    (void)zoomed.ExtensionError(at);
    (void)zoomed.NativeFromFNumber(zoomed.FNumberFromNative(at));
    (void)zoomed.NativeFromFocalLength(zoomed.FocalLengthFromNative(at));
  }
}

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
  AskAll(*read);
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
