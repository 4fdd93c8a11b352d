// [focus_at] of a calibration file: the names and units of the coordinates, and one table for each sample. Names and
// units hold nothing that TOML would have to escape.
#include <algorithm>
#include <cctype>

#include "rig/common/toml_number.h"
#include "rig/focus_at.h"

namespace lensd::rig {
namespace {

constexpr double kMetresPerNm = 1e-9;
constexpr double kMostValue = 1e9;
constexpr std::size_t kLongestName = 32;

bool IsWord(const std::string& text) {
  return text.size() <= kLongestName && std::ranges::all_of(text, [](unsigned char c) {
           return c > ' ' && c < 0x7F && c != '"' && c != '\\' && c != '=' && c != ',';
         });
}

template <class Unit>
void Line(std::string& text, const char* key, const std::optional<Quantity<Unit>>& value, double unit = 1.0) {
  if (value) text += std::string(key) + " = " + NumberText(value->value / unit) + "\n";
}

template <class Unit>
void Take(const std::optional<double>& number, std::optional<Quantity<Unit>>& value, double unit = 1.0) {
  if (number) value = Quantity<Unit>{*number * unit};
}

Result<FocusAtSample> ReadSample(const Settings& table, std::size_t coordinates) {
  SettingsReader read(table, "[[focus_at.sample]]");
  FocusAtSample sample;
  const auto at = read.OptionalNumbers("at", coordinates, {-kMostValue, kMostValue});
  if (!at) read.Reject("at", "must have a number for each coordinate");
  sample.at = at.value_or(std::vector<double>{});
  sample.position = Native{read.RequiredNumber("steps")};
  sample.sigma = Native{read.RequiredNumber("sigma_steps", {FocusAtSamples::kLeastSigma, FocusAtSamples::kMostSigma})};
  sample.under.approach_up = read.Choice("approach", {"up", "down"}, 0) == 0;
  Take(read.OptionalNumber("zoom_steps"), sample.under.zoom);
  Take(read.OptionalNumber("filter"), sample.under.filter);
  Take(read.OptionalNumber("temperature_c"), sample.under.temperature);
  Take(read.OptionalNumber("f_number", kPositive), sample.under.f_number);
  Take(read.OptionalNumber("wavelength_nm", kPositive), sample.under.wavelength, kMetresPerNm);
  sample.made = read.Text("made", "");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return sample;
}

}  // namespace

bool IsFocusAtCoordinate(const FocusAtCoordinate& coordinate) {
  return !coordinate.name.empty() && IsWord(coordinate.name) && IsWord(coordinate.unit);
}

Result<FocusAtSamples> ReadFocusAt(const Settings& table) {
  SettingsReader read(table, "[focus_at]");
  FocusAtSamples known;
  const auto coordinates = read.Tables("coordinate");
  const auto samples = read.Tables("sample");
  if (coordinates.empty() || coordinates.size() > FocusAtSamples::kMostCoordinates) {
    read.Reject("coordinate", "must be one to three tables");
  }
  if (samples.empty() || samples.size() > FocusAtSamples::kMost) read.Reject("sample", "must be 1 to 30 tables");
  if (auto done = read.Finish(); !done) return PassOn(done);
  for (const Settings* entry : coordinates) {
    SettingsReader at(*entry, "[[focus_at.coordinate]]");
    FocusAtCoordinate coordinate;
    coordinate.name = at.RequiredText("name");
    coordinate.unit = at.Text("unit", "");
    if (!IsFocusAtCoordinate(coordinate)) at.Reject("name", "and unit are words of at most 32 plain characters");
    if (auto done = at.Finish(); !done) return PassOn(done);
    known.coordinates.push_back(std::move(coordinate));
  }
  for (const Settings* entry : samples) {
    auto sample = ReadSample(*entry, known.coordinates.size());
    if (!sample) return PassOn(sample);
    known.samples.push_back(*std::move(sample));
  }
  return known;
}

std::string FocusAtText(const FocusAtSamples& known) {
  std::string text;
  for (const FocusAtCoordinate& coordinate : known.coordinates) {
    text += "\n[[focus_at.coordinate]]\nname = \"" + coordinate.name + "\"\n";
    if (!coordinate.unit.empty()) text += "unit = \"" + coordinate.unit + "\"\n";
  }
  for (const FocusAtSample& sample : known.samples) {
    text += "\n[[focus_at.sample]]\nat = [";
    for (const double value : sample.at) text += (text.back() == '[' ? "" : ", ") + NumberText(value);
    text += "]\n";
    Line(text, "steps", std::optional(sample.position));
    Line(text, "sigma_steps", std::optional(sample.sigma));
    text += std::string("approach = ") + (sample.under.approach_up ? "\"up\"\n" : "\"down\"\n");
    Line(text, "zoom_steps", sample.under.zoom);
    Line(text, "filter", sample.under.filter);
    Line(text, "temperature_c", sample.under.temperature);
    Line(text, "f_number", sample.under.f_number);
    Line(text, "wavelength_nm", sample.under.wavelength, kMetresPerNm);
    if (!sample.made.empty()) text += "made = \"" + sample.made + "\"\n";
  }
  return text;
}

}  // namespace lensd::rig
