// Temperatures and places count from their weighted means over each subject: what is left has one slope in common. A
// subject that was focused once says nothing of it.
#include "rig/focus_drift.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <span>
#include <utility>

#include "base/quantity_text.h"
#include "rig/common/toml_number.h"

namespace lensd::rig {
namespace {

constexpr int kFewestSpare = 3;         ///< samples more than the coefficient and the subjects' places take
constexpr double kLeastSpread = 2.0;    ///< degrees, within one subject
constexpr double kTail = 0.025;         ///< on either side of the interval
constexpr double kOutlierTail = 5e-4;   ///< on either side of what the others promise of a sample
constexpr double kApart = 0.05;         ///< degrees: less says nothing of a slope
constexpr double kLeastScatter = 0.05;  ///< variance over the claimed one: less is luck
constexpr double kMetresPerUm = 1e-6;
constexpr Range kTemperatures{-273.15, 1e3}, kExtensions{-1e9, 1e9}, kSigmas{1e-6, 1e9};

using DriftSamples = std::vector<const DriftSample*>;

struct SubjectMean {
  double weight = 0.0, temperature = 0.0, extension = 0.0;
  double coldest = 0.0, hottest = 0.0;
  int count = 0;
};

double WeightOf(const DriftSample& sample) {
  return 1.0 / (sample.sigma.value * sample.sigma.value);
}

double Student(int freedom, double tail) {
  return -boost::math::quantile(boost::math::students_t(freedom), tail);
}

struct DriftFit {
  std::map<int, SubjectMean> subjects;  ///< one sample alone tells nothing of the slope
  double slope = 0.0;                   ///< of the place of focus: metres a degree
  double lever = 0.0;                   ///< weighted squares of the temperatures
  double scatter = 1.0;                 ///< variance over the claimed one
  double spread = 0.0;                  ///< degrees, the greatest within one subject
  double coldest = 0.0, hottest = 0.0;
  int used = 0;
  int spare = 0;

  double Off(const DriftSample& sample) const {
    const SubjectMean& mean = subjects.at(sample.subject);
    return sample.extension.value - mean.extension - slope * (sample.temperature.value - mean.temperature);
  }
  double Error() const { return std::sqrt(scatter / lever); }
};

DriftFit SolveDrift(const DriftSamples& samples) {
  DriftFit fit;
  for (const DriftSample* sample : samples) {
    SubjectMean& mean = fit.subjects[sample->subject];
    const double temperature = sample->temperature.value;
    mean.coldest = mean.count == 0 ? temperature : std::min(mean.coldest, temperature);
    mean.hottest = mean.count == 0 ? temperature : std::max(mean.hottest, temperature);
    const double weight = WeightOf(*sample);
    mean.weight += weight;
    mean.temperature += weight / mean.weight * (temperature - mean.temperature);
    mean.extension += weight / mean.weight * (sample->extension.value - mean.extension);
    ++mean.count;
  }
  double product = 0.0, squares = 0.0;
  for (const DriftSample* sample : samples) {
    const SubjectMean& mean = fit.subjects.at(sample->subject);
    const double warmer = sample->temperature.value - mean.temperature;
    fit.lever += WeightOf(*sample) * warmer * warmer;
    product += WeightOf(*sample) * warmer * (sample->extension.value - mean.extension);
  }
  int places = 0;
  for (const auto& [number, mean] : fit.subjects) {
    if (mean.count < 2) continue;
    fit.used += mean.count;
    ++places;
    if (places == 1) fit.coldest = mean.coldest, fit.hottest = mean.hottest;
    fit.coldest = std::min(fit.coldest, mean.coldest);
    fit.hottest = std::max(fit.hottest, mean.hottest);
    fit.spread = std::max(fit.spread, mean.hottest - mean.coldest);
  }
  fit.spare = fit.used - places - 1;
  if (!(fit.lever > 0.0)) return fit;
  fit.slope = product / fit.lever;
  for (const DriftSample* sample : samples) squares += WeightOf(*sample) * std::pow(fit.Off(*sample), 2);
  if (fit.spare > 0) fit.scatter = std::max(squares / fit.spare, kLeastScatter);
  return fit;
}

DriftSamples KeptDrift(const std::vector<DriftSample>& samples) {
  DriftSamples kept;
  for (const DriftSample& sample : samples) {
    if (!sample.outlier) kept.push_back(&sample);
  }
  return kept;
}

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// How many sigmas each sample is off the median of the slopes between two samples of one subject (Theil, 1950; Sen,
/// 1968), from the median of its subject; empty: all have one temperature.
std::vector<double> RobustlyOff(const std::vector<DriftSample>& samples) {
  std::vector<double> slopes;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double warmer = (samples[i].temperature - samples[j].temperature).value;
      if (samples[i].subject != samples[j].subject || std::abs(warmer) < kApart) continue;
      slopes.push_back((samples[i].extension - samples[j].extension).value / warmer);
    }
  }
  if (slopes.empty()) return {};
  const double slope = MedianOf(std::move(slopes));
  const auto place = [slope](const DriftSample& sample) {
    return sample.extension.value - slope * sample.temperature.value;
  };
  std::map<int, std::vector<double>> places;
  for (const DriftSample& sample : samples) places[sample.subject].push_back(place(sample));
  std::vector<double> off;
  off.reserve(samples.size());
  for (const DriftSample& sample : samples) {
    off.push_back(std::abs(place(sample) - MedianOf(places[sample.subject])) / sample.sigma.value);
  }
  return off;
}

/// Whether the coefficient through the others misses it by no more than they promise.
bool Belongs(const DriftSample& sample, const DriftFit& others) {
  const auto mean = others.subjects.find(sample.subject);
  if (mean == others.subjects.end() || others.spare < kFewestSpare || !(others.lever > 0.0)) return true;
  const double warmer = sample.temperature.value - mean->second.temperature;
  const double variance =
      others.scatter * (1.0 / WeightOf(sample) + 1.0 / mean->second.weight + warmer * warmer / others.lever);
  return std::abs(others.Off(sample)) <= std::sqrt(variance) * Student(others.spare, kOutlierTail);
}

/// The third that is farthest off is left out at first; then each of those that belongs comes back, the nearest first:
/// two outliers would hide each other if all others were asked of one.
void NameOutliers(std::vector<DriftSample>& samples) {
  for (DriftSample& sample : samples) sample.outlier = false;
  const std::vector<double> off = RobustlyOff(samples);
  const int most = std::min(static_cast<int>(samples.size()) / 3, SolveDrift(KeptDrift(samples)).spare - kFewestSpare);
  if (off.empty() || most <= 0) return;
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return off[i]; });
  const auto suspects = std::span(order).last(static_cast<std::size_t>(most));
  for (const std::size_t i : suspects) samples[i].outlier = true;
  for (bool back = true; std::exchange(back, false);) {
    for (const std::size_t i : suspects) {
      if (!samples[i].outlier || !Belongs(samples[i], SolveDrift(KeptDrift(samples)))) continue;
      samples[i].outlier = false;
      back = true;
    }
  }
}

/// Rounded, it stays in the range that is read.
std::string Micrometres(Metres length, Range range) {
  return NumberText(std::clamp(length.value / kMetresPerUm, range.minimum, range.maximum));
}

Result<DriftSample> ReadDriftSample(const Settings& table) {
  SettingsReader read(table, "[[result]]");
  DriftSample sample;
  sample.subject = static_cast<int>(read.Integer("subject", sample.subject, {1, 1e9}));
  sample.temperature = Celsius{read.RequiredNumber("temperature_c", kTemperatures)};
  sample.extension = Metres{read.RequiredNumber("extension_um", kExtensions) * kMetresPerUm};
  sample.sigma = Metres{read.RequiredNumber("sigma_um", kSigmas) * kMetresPerUm};
  sample.made = read.Text("made", "");
  const auto plain = [](unsigned char c) { return c >= ' ' && c < 0x7F && c != '"' && c != '\\'; };
  if (!std::ranges::all_of(sample.made, plain)) read.Reject("made", "is a date and time");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return sample;
}

}  // namespace

Result<FocusDrift> FitFocusDrift(std::vector<DriftSample>& samples) {
  for (DriftSample& sample : samples) sample.off = Metres{};
  NameOutliers(samples);
  const DriftFit fit = SolveDrift(KeptDrift(samples));
  if (fit.spare < kFewestSpare) {
    return Fail(Code::OutOfRange, "how focus changes with the temperature is not learned yet: it needs " +
                                      std::to_string(kFewestSpare - fit.spare) +
                                      " more autofocus results of a subject that was focused before");
  }
  if (fit.spread < kLeastSpread) {
    return Fail(Code::OutOfRange, "how focus goes with the temperature is not learned yet: the results span " +
                                      Short(fit.spread, 2) + " C, and it takes " + Short(kLeastSpread) + " C");
  }
  for (DriftSample& sample : samples) {
    if (fit.subjects.contains(sample.subject)) sample.off = Metres{fit.Off(sample)};
  }
  const double half = Student(fit.spare, kTail) * fit.Error();
  return FocusDrift{.per_degree = Metres{-fit.slope},
                    .low = Metres{-fit.slope - half},
                    .high = Metres{-fit.slope + half},
                    .coldest = Celsius{fit.coldest},
                    .hottest = Celsius{fit.hottest},
                    .used = fit.used};
}

Result<std::vector<DriftSample>> ReadFocusDrift(const Settings& file) {
  SettingsReader read(file, "what was learned of focus");
  if (!read.Has("version")) read.Reject("version", "the file must say version = 1");
  if (read.Integer("version", 1) != 1) read.Reject("version", "must be 1: this lensd reads version 1 alone");
  const auto tables = read.Tables("result");
  if (tables.size() > DriftSample::kMost) read.Reject("result", "must be 200 tables at most");
  if (auto done = read.Finish(); !done) return PassOn(done);
  std::vector<DriftSample> samples;
  for (const Settings* table : tables) {
    auto sample = ReadDriftSample(*table);
    if (!sample) return PassOn(sample);
    samples.push_back(*std::move(sample));
  }
  return samples;
}

std::string FocusDriftText(const std::vector<DriftSample>& samples) {
  if (samples.empty()) return "";
  std::string text =
      "# How focus goes with the temperature, by autofocus: lensctl refocus shows and forgets it.\nversion = 1\n";
  for (const DriftSample& sample : samples) {
    text += "\n[[result]]\nsubject = " + std::to_string(sample.subject) +
            "\ntemperature_c = " + NumberText(sample.temperature.value) +
            "\nextension_um = " + Micrometres(sample.extension, kExtensions) +
            "\nsigma_um = " + Micrometres(sample.sigma, kSigmas) + "\n";
    if (!sample.made.empty()) text += "made = \"" + sample.made + "\"\n";
  }
  return text;
}

}  // namespace lensd::rig
