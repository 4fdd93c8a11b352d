// Reading names the table and key of what is wrong; writing gives numbers the fewest digits that read back the same, so
// nothing is lost between the two.
#include "rig/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "rig/common/toml_number.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr std::array<std::string_view, 3> kGrades = {"uncalibrated", "approximate", "calibrated"};

// ---- reading ------------------------------------------------------------------------------------------------------

template <class Unit>
std::optional<Quantity<Unit>> OptionalIn(SettingsReader& read, std::string_view key, double unit, Range range = {}) {
  const auto number = read.OptionalNumber(key, range);
  if (!number) return std::nullopt;
  return Quantity<Unit>{*number * unit};
}
constexpr std::string_view kFocalLength = "focal_length_mm";
constexpr double kMm = 1e-3, kUm = 1e-6, kNm = 1e-9, kPercent = 1e-2;

Result<FocusPoint> ReadFocusPoint(const Settings& table) {
  SettingsReader read(table, "a point of [[focus]]");
  FocusPoint point;
  point.position = Native{read.RequiredNumber("steps")};
  point.extension = OptionalIn<MetresUnit>(read, "extension_mm", kMm);
  point.vergence = OptionalIn<DioptresUnit>(read, "vergence_d", 1.0);
  if (const auto distance = read.OptionalNumber("distance_m", kPositive)) {
    if (point.vergence) read.Reject("distance_m", "says the same as vergence_d: leave one out");
    point.vergence = Dioptres{1.0 / *distance};
  }
  if (point.extension.has_value() == point.vergence.has_value()) {
    read.Reject("", "needs exactly one of extension_mm, vergence_d and distance_m");
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return point;
}

Result<FocusCurve> ReadFocusCurve(const Settings& table) {
  SettingsReader read(table, "[[focus]]");
  FocusCurve curve;
  read.RequiredText("approach");
  curve.approach_near = read.Choice("approach", {"near", "far"}, 0) == 0;
  curve.focal_length = OptionalIn<MetresUnit>(read, "focal_length_mm", kMm, kPositive);
  curve.filter = read.OptionalNumber("filter");
  curve.wavelength = OptionalIn<MetresUnit>(read, "wavelength_nm", kNm, kPositive);
  curve.temperature = OptionalIn<CelsiusUnit>(read, "temperature_c", 1.0);
  curve.error = Metres{read.RequiredNumber("error_um", kNonNegative) * kUm};
  const auto points = read.Tables("points");
  if (points.size() < 2) read.Reject("points", "must be two or more, such as { steps = 0, vergence_d = 0.0 }");
  if (auto done = read.Finish(); !done) return PassOn(done);
  for (const Settings* entry : points) {
    auto point = ReadFocusPoint(*entry);
    if (!point) return PassOn(point);
    if (!curve.points.empty() && !(curve.points.back().position < point->position)) {
      return Fail(Code::BadData, entry->where().Text() + ": steps must rise from point to point");
    }
    curve.points.push_back(*point);
  }
  return curve;
}

Result<AxisCurve> ReadAxisCurve(const Settings& table, const std::string& name, std::string_view key, double unit) {
  SettingsReader read(table, name);
  AxisCurve curve;
  curve.error = read.Number("error_percent", 0.0, {0.0, 50.0}) * kPercent;
  const auto points = read.Tables("points");
  if (points.size() < 2) read.Reject("points", "must be two or more");
  if (auto done = read.Finish(); !done) return PassOn(done);
  for (const Settings* entry : points) {
    SettingsReader at(*entry, "a point of " + name);
    const Native position{at.RequiredNumber("steps")};
    curve.points.push_back({position, at.RequiredNumber(key, kPositive) * unit});
    if (key == kFocalLength) curve.points.back().centre_shift = OptionalIn<MetresUnit>(at, "centre_shift_mm", kMm);
    if (curve.points.back().centre_shift.has_value() != curve.points.front().centre_shift.has_value()) {
      at.Reject("centre_shift_mm", "must be in all points of " + name + " or in none");
    }
    if (auto done = at.Finish(); !done) return PassOn(done);
    const std::size_t n = curve.points.size();
    if (n > 1 && !(curve.points[n - 2].position < position)) {
      return Fail(Code::BadData, entry->where().Text() + ": steps must rise from point to point");
    }
    const auto change = [&](std::size_t i) { return curve.points[i].value - curve.points[i - 1].value; };
    if (n > 1 && !(change(n - 1) * change(1) > 0.0)) {
      return Fail(Code::BadData, entry->where().Text() + ": " + std::string(key) + " must rise or fall throughout");
    }
  }
  return curve;
}

Result<std::vector<BreathingPoint>> ReadBreathing(const Settings& table) {
  SettingsReader read(table, "[breathing]");
  const auto points = read.Tables("points");
  if (points.size() < 2) read.Reject("points", "must be two or more, such as { extension_mm = 0.0, ratio = 1.0 }");
  if (auto done = read.Finish(); !done) return PassOn(done);
  std::vector<BreathingPoint> breathing;
  for (const Settings* entry : points) {
    SettingsReader at(*entry, "a point of [breathing]");
    const Metres extension{at.RequiredNumber("extension_mm") * kMm};
    breathing.push_back({extension, at.RequiredNumber("ratio", {0.5, 2.0})});
    if (auto done = at.Finish(); !done) return PassOn(done);
    if (breathing.size() > 1 && !(breathing[breathing.size() - 2].extension < extension)) {
      return Fail(Code::BadData, entry->where().Text() + ": extension_mm must rise from point to point");
    }
  }
  return breathing;
}

Result<TemperatureModel> ReadTemperature(const Settings& table) {
  SettingsReader read(table, "[temperature]");
  TemperatureModel model;
  model.per_degree = Metres{read.RequiredNumber("um_per_c", {-1e4, 1e4}) * kUm};
  model.per_degree_error = Metres{read.Number("um_per_c_error", 0.0, kNonNegative) * kUm};
  model.reference = Celsius{read.Number("reference_c", model.reference.value, {-273.15, 1e3})};
  if (const auto range = read.OptionalNumbers("range_c", 2, {-273.15, 1e3})) {
    if ((*range)[0] > (*range)[1]) read.Reject("range_c", "must have its smaller number first");
    model.coldest = Celsius{(*range)[0]};
    model.hottest = Celsius{(*range)[1]};
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return model;
}

Result<Backlash> ReadBacklash(const Settings& table, std::string_view axis) {
  SettingsReader read(table, "[backlash." + std::string(axis) + "]");
  Backlash backlash;
  backlash.steps = backlash.low = backlash.high = read.RequiredNumber("steps", kNonNegative);
  if (const auto interval = read.OptionalNumbers("interval", 2, kNonNegative)) {
    backlash.low = (*interval)[0];
    backlash.high = (*interval)[1];
    if (backlash.low > backlash.steps || backlash.high < backlash.steps) {
      read.Reject("interval", "must contain steps");
    }
  }
  backlash.measured = read.Boolean("measured", false);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return backlash;
}

/// Reads a sub-table into `into` where there is one.
template <class T, class Reader>
Result<void> ReadPart(const Settings* table, T& into, Reader reader) {
  if (table == nullptr) return {};
  auto part = reader(*table);
  if (!part) return PassOn(part);
  into = *std::move(part);
  return {};
}

Result<void> ReadBacklashes(const Settings* table, Calibration& calibration) {
  if (table == nullptr) return {};
  SettingsReader read(*table, "[backlash]");
  for (const Axis axis : drivers::kAxes) {
    const auto one = [axis](const Settings& at) { return ReadBacklash(at, AxisName(axis)); };
    if (auto done = ReadPart(read.Table(AxisName(axis)), calibration.backlash[axis], one); !done) return done;
  }
  return read.Finish();
}

// ---- writing ------------------------------------------------------------------------------------------------------

std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += code < 0x20 || code == 0x7F ? ' ' : c;
  }
  return quoted + "\"";
}

void Line(std::string& text, std::string_view key, double value) {
  text += std::string(key) + " = " + NumberText(value) + "\n";
}

void WriteFocus(std::string& text, const FocusCurve& curve) {
  text += "\n[[focus]]\napproach = " + Quoted(curve.approach_near ? "near" : "far") + "\n";
  if (curve.focal_length) Line(text, "focal_length_mm", curve.focal_length->value / kMm);
  if (curve.filter) Line(text, "filter", *curve.filter);
  if (curve.wavelength) Line(text, "wavelength_nm", curve.wavelength->value / kNm);
  if (curve.temperature) Line(text, "temperature_c", curve.temperature->value);
  Line(text, "error_um", curve.error.value / kUm);
  text += "points = [\n";
  for (const FocusPoint& point : curve.points) {
    text += "  { steps = " + NumberText(point.position.value);
    text += point.extension ? ", extension_mm = " + NumberText(point.extension->value / kMm)
                            : ", vergence_d = " + NumberText(point.vergence->value);
    text += " },\n";
  }
  text += "]\n";
}

void WriteAxis(std::string& text, std::string_view name, const AxisCurve& curve, std::string_view key, double unit) {
  text += "\n[" + std::string(name) + "]\n";
  Line(text, "error_percent", curve.error / kPercent);
  text += "points = [\n";
  for (const auto& point : curve.points) {
    text += "  { steps = " + NumberText(point.position.value) + ", " + std::string(key) + " = " +
            NumberText(point.value / unit);
    if (point.centre_shift) text += ", centre_shift_mm = " + NumberText(point.centre_shift->value / kMm);
    text += " },\n";
  }
  text += "]\n";
}

void WriteTemperature(std::string& text, const TemperatureModel& model) {
  text += "\n[temperature]\n";
  Line(text, "um_per_c", model.per_degree.value / kUm);
  Line(text, "um_per_c_error", model.per_degree_error.value / kUm);
  Line(text, "reference_c", model.reference.value);
  text += "range_c = [" + NumberText(model.coldest.value) + ", " + NumberText(model.hottest.value) + "]\n";
}

void WriteBacklash(std::string& text, Axis axis, const Backlash& backlash) {
  text += "\n[backlash." + std::string(AxisName(axis)) + "]\n";
  Line(text, "steps", backlash.steps);
  text += "interval = [" + NumberText(backlash.low) + ", " + NumberText(backlash.high) + "]\n";
  text += std::string("measured = ") + (backlash.measured ? "true\n" : "false\n");
}

}  // namespace

std::string_view GradeName(Grade grade) {
  return kGrades.at(static_cast<std::size_t>(grade));
}

bool FocusCurve::SameConditions(const FocusCurve& other) const {
  return approach_near == other.approach_near && focal_length == other.focal_length && filter == other.filter &&
         wavelength == other.wavelength && temperature == other.temperature;
}

void Calibration::Put(FocusCurve curve) {
  const auto same = std::ranges::find_if(focus, [&](const FocusCurve& old) { return old.SameConditions(curve); });
  if (same != focus.end()) {
    *same = std::move(curve);
  } else {
    focus.push_back(std::move(curve));
  }
}

void Calibration::Put(FocusShift shift) {
  std::erase_if(focus_shifts, [&](const FocusShift& old) { return old.SamePair(shift); });
  focus_shifts.push_back(std::move(shift));
}

Result<Calibration> ReadCalibration(const Settings& file) {
  SettingsReader read(file, "the calibration");
  Calibration calibration;
  if (!read.Has("version")) read.Reject("version", "the file must say version = 1");
  if (read.Integer("version", 1) != 1) read.Reject("version", "must be 1: this lensd reads version 1 alone");
  calibration.serial = read.RequiredText("serial");
  calibration.made = read.Text("made", "");
  calibration.grade = static_cast<Grade>(read.Choice("grade", {kGrades.begin(), kGrades.end()}, 2));
  if (calibration.grade == Grade::Uncalibrated) read.Reject("grade", "must be approximate or calibrated");
  const auto focus = read.Tables("focus");
  const auto shifts = read.Tables("focus_shift");
  const Settings* const focus_at = read.Table("focus_at");
  const Settings* const iris = read.Table("iris");
  const Settings* const zoom = read.Table("zoom");
  const Settings* const breathing = read.Table("breathing");
  const Settings* const temperature = read.Table("temperature");
  const Settings* const backlash = read.Table("backlash");
  if (auto done = read.Finish(); !done) return PassOn(done);
  for (const Settings* table : focus) {
    auto curve = ReadFocusCurve(*table);
    if (!curve) return PassOn(curve);
    const auto same = [&](const FocusCurve& other) { return other.SameConditions(*curve); };
    if (std::ranges::any_of(calibration.focus, same)) {
      return Fail(Code::BadData, table->where().Text() + ": there is another [[focus]] of the same conditions");
    }
    calibration.focus.push_back(*std::move(curve));
  }
  for (const Settings* table : shifts) {
    auto shift = ReadFocusShift(*table);
    if (!shift) return PassOn(shift);
    calibration.Put(*std::move(shift));
  }
  const auto f_numbers = [](const Settings& at) { return ReadAxisCurve(at, "[iris]", "f_number", 1.0); };
  const auto focal_lengths = [](const Settings& at) { return ReadAxisCurve(at, "[zoom]", kFocalLength, kMm); };
  if (auto done = ReadPart(iris, calibration.iris, f_numbers); !done) return PassOn(done);
  if (auto done = ReadPart(zoom, calibration.zoom, focal_lengths); !done) return PassOn(done);
  if (auto done = ReadPart(focus_at, calibration.focus_at, ReadFocusAt); !done) return PassOn(done);
  if (auto done = ReadPart(breathing, calibration.breathing, ReadBreathing); !done) return PassOn(done);
  if (auto done = ReadPart(temperature, calibration.temperature, ReadTemperature); !done) {
    return PassOn(done);
  }
  if (auto done = ReadBacklashes(backlash, calibration); !done) return PassOn(done);
  return calibration;
}

std::string CalibrationText(const Calibration& calibration) {
  std::string text =
      "# What lensd knows of one lens. docs/calibration.md explains every key. Vergence is 1/distance from the lens\n"
      "# centre in dioptres (0: infinity); extension is the sensor's distance beyond the focal length.\n"
      "version = 1\n";
  text += "serial = " + Quoted(calibration.serial) + "\n";
  if (!calibration.made.empty()) text += "made = " + Quoted(calibration.made) + "\n";
  text += "grade = " + Quoted(GradeName(calibration.grade)) + "\n";
  if (calibration.temperature) WriteTemperature(text, *calibration.temperature);
  for (const Axis axis : drivers::kAxes) {
    if (calibration.backlash[axis]) WriteBacklash(text, axis, *calibration.backlash[axis]);
  }
  if (calibration.iris) WriteAxis(text, "iris", *calibration.iris, "f_number", 1.0);
  if (calibration.zoom) WriteAxis(text, "zoom", *calibration.zoom, kFocalLength, kMm);
  if (!calibration.breathing.empty()) {
    text += "\n[breathing]\npoints = [\n";
    for (const BreathingPoint& point : calibration.breathing) {
      text += "  { extension_mm = " + NumberText(point.extension.value / kMm) + ", ratio = " + NumberText(point.ratio) +
              " },\n";
    }
    text += "]\n";
  }
  for (const FocusShift& shift : calibration.focus_shifts) text += FocusShiftText(shift);
  if (calibration.focus_at) text += FocusAtText(*calibration.focus_at);
  for (const FocusCurve& curve : calibration.focus) WriteFocus(text, curve);
  return text;
}

}  // namespace lensd::rig
