// Runs count only under the conditions they were made under. A ratio to what was told means nothing once something else
// is told: then the pixels of blur a native unit that a run has seen are compared with what is told of its place now.
#include "rig/learned_slope.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rig/common/toml_number.h"

namespace lensd::rig {
namespace {

using autofocus::SlopeLearner;

constexpr double kSameOpening = 0.05, kSameFocalLength = 0.02, kSamePixel = 0.01;  // logarithms
constexpr double kSamePosition = 0.5;                                              // native units
constexpr Range kRunPixels{0.01, 1e4}, kRunPositions{-1e12, 1e12}, kRunToldSlopes{1e-12, 1e12},
    kRunLogs{-SlopeLearner::kMostLog, SlopeLearner::kMostLog},
    kRunUneven{-SlopeLearner::kMostLog, SlopeLearner::kMostLog};

bool WithinLog(double one, double other, double log) {
  return std::abs(std::log(one / other)) <= log;
}

/// By what their positions mean, where that is known.
template <class Meaning>
bool SameSlopePlace(std::optional<Native> one, std::optional<Native> other, bool known, double log,
                    const Meaning& meaning) {
  if (!one || !other) return one.has_value() == other.has_value();
  if (!known) return std::abs((*one - *other).value) <= kSamePosition;
  return WithinLog(meaning(*one), meaning(*other), log);
}

std::optional<Native> ReadSlopePlace(SettingsReader& read, const char* key) {
  const auto number = read.OptionalNumber(key, kRunPositions);
  return number ? std::optional(Native{*number}) : std::nullopt;
}

Result<SlopeRun> ReadSlopeRun(const Settings& table) {
  SettingsReader read(table, "[[run]]");
  SlopeRun run;
  run.under.iris = ReadSlopePlace(read, "iris");
  run.under.zoom = ReadSlopePlace(read, "zoom");
  run.under.pixel_um = read.RequiredNumber("pixel_um", kRunPixels);
  if (read.Boolean("frames_from_outside", false)) run.under.frames = SlopeConditions::Frames::Outside;
  run.position = Native{read.RequiredNumber("position", kRunPositions)};
  run.told_px = read.RequiredNumber("told_px", kRunToldSlopes);
  run.log_factor = read.RequiredNumber("log_factor", kRunLogs);
  run.uneven = read.OptionalNumber("uneven", kRunUneven);
  run.made = read.Text("made", "");
  const auto plain = [](unsigned char c) { return c >= ' ' && c < 0x7F && c != '"' && c != '\\'; };
  if (!std::ranges::all_of(run.made, plain)) read.Reject("made", "is a date and time");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return run;
}

/// Rounded, it stays in the range that is read.
std::string SlopeLine(const char* key, double value, Range range) {
  return std::string(key) + " = " + NumberText(std::clamp(value, range.minimum, range.maximum)) + "\n";
}

}  // namespace

std::optional<double> ToldSlope(const OpticsTable& optics, const SlopeConditions& under, Native focus) {
  if (!optics.has_focus() || optics.nominal().liquid || !(under.pixel_um > 0)) return std::nullopt;
  std::optional<FNumber> f_number = optics.fixed_f_number();
  if (optics.has_iris()) {
    f_number = under.iris ? std::optional(optics.FNumberFromNative(*under.iris)) : std::nullopt;
  }
  if (!f_number) return std::nullopt;
  // A short step each way: between the points of a calibration the curve is smooth.
  const double step = 1e-3 * std::max(1.0, std::abs(focus.value));
  const Metres above = optics.ExtensionFromNative(focus + Native{step});
  const Metres below = optics.ExtensionFromNative(focus - Native{step});
  constexpr double kMetresPerUm = 1e-6;
  const double told = std::abs((above - below).value) / (2.0 * step * f_number->value * under.pixel_um * kMetresPerUm);
  if (!std::isfinite(told) || !(told > 0)) return std::nullopt;
  return told;
}

bool SlopeHoldsUnder(const SlopeConditions& one, const SlopeConditions& other, const OpticsTable& optics) {
  return one.frames == other.frames && WithinLog(one.pixel_um, other.pixel_um, kSamePixel) &&
         SameSlopePlace(one.iris, other.iris, optics.has_iris(), kSameOpening,
                        [&](Native iris) { return optics.FNumberFromNative(iris).value; }) &&
         SameSlopePlace(one.zoom, other.zoom, optics.has_zoom(), kSameFocalLength,
                        [&](Native zoom) { return optics.FocalLengthFromNative(zoom).value; });
}

LearnedSlope::LearnedSlope(std::vector<SlopeRun> runs) : runs_(std::move(runs)) {}

SlopeLearner LearnedSlope::LearnerFor(const SlopeConditions& under, const OpticsTable& optics) const {
  std::vector<SlopeLearner::Shown> shown;
  for (auto run = runs_.rbegin(); run != runs_.rend() && shown.size() < SlopeLearner::kMost; ++run) {
    if (!SlopeHoldsUnder(run->under, under, optics)) continue;
    const auto told = ToldSlope(optics, run->under, run->position);
    if (!told) continue;
    const double log = run->log_factor + std::log(run->told_px / *told);
    if (std::abs(log) <= SlopeLearner::kMostLog) shown.push_back({log, run->uneven});
  }
  std::ranges::reverse(shown);
  return SlopeLearner(std::move(shown));
}

SlopeLearner::Learned LearnedSlope::Add(SlopeRun run, const OpticsTable& optics) {
  run.log_factor = std::clamp(run.log_factor, -SlopeLearner::kMostLog, SlopeLearner::kMostLog);
  const auto told = ToldSlope(optics, run.under, run.position);
  const double now = run.log_factor + (told ? std::log(run.told_px / *told) : 0.0);
  const auto learned = LearnerFor(run.under, optics).Add({now, run.uneven});
  if (learned == SlopeLearner::Learned::AnotherLens) runs_.clear();
  runs_.push_back(std::move(run));
  if (runs_.size() > SlopeRun::kMost) runs_.erase(runs_.begin());
  return learned;
}

std::optional<autofocus::KnownSlope> LearnedSlope::Known(const SlopeConditions& under,
                                                         const OpticsTable& optics) const {
  auto known = LearnerFor(under, optics).Known();
  if (!known) return std::nullopt;
  const auto last = std::ranges::find_if(
      runs_.rbegin(), runs_.rend(), [&](const SlopeRun& run) { return SlopeHoldsUnder(run.under, under, optics); });
  if (last != runs_.rend()) known->last_focus = optics.ExtensionFromNative(last->position).value;
  return known;
}

Result<std::vector<SlopeRun>> ReadLearnedSlope(const Settings& file) {
  SettingsReader read(file, "what was learned of blur");
  if (!read.Has("version")) read.Reject("version", "the file must say version = 1");
  if (read.Integer("version", 1) != 1) read.Reject("version", "must be 1: this lensd reads version 1 alone");
  const auto tables = read.Tables("run");
  if (tables.size() > SlopeRun::kMost) read.Reject("run", "must be 200 tables at most");
  if (auto done = read.Finish(); !done) return PassOn(done);
  std::vector<SlopeRun> runs;
  for (const Settings* table : tables) {
    auto run = ReadSlopeRun(*table);
    if (!run) return PassOn(run);
    runs.push_back(*std::move(run));
  }
  return runs;
}

std::string LearnedSlopeText(const std::vector<SlopeRun>& runs) {
  if (runs.empty()) return "";
  std::string text =
      "# How blur grows with focus, as autofocus has seen it: lensctl learned shows and forgets it.\nversion = 1\n";
  for (const SlopeRun& run : runs) {
    text += "\n[[run]]\n";
    if (run.under.iris) text += SlopeLine("iris", run.under.iris->value, kRunPositions);
    if (run.under.zoom) text += SlopeLine("zoom", run.under.zoom->value, kRunPositions);
    text += SlopeLine("pixel_um", run.under.pixel_um, kRunPixels);
    if (run.under.frames == SlopeConditions::Frames::Outside) text += "frames_from_outside = true\n";
    text += SlopeLine("position", run.position.value, kRunPositions) +
            SlopeLine("told_px", run.told_px, kRunToldSlopes) + SlopeLine("log_factor", run.log_factor, kRunLogs);
    if (run.uneven) text += SlopeLine("uneven", *run.uneven, kRunUneven);
    if (!run.made.empty()) text += "made = \"" + run.made + "\"\n";
  }
  return text;
}

}  // namespace lensd::rig
