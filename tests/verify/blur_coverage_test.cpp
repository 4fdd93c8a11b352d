// Do the error bars of lensctl verify contain the truth, and how do they compare with what the frames allow? Frames
// are sums of sinusoids with photon and read noise, rounded; what a disk leaves of each sinusoid is integrated here,
// chord by chord, and the Cramér-Rao bound is worked out from the very sinusoids: nothing is shared with what is
// judged.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "test_level.h"
#include "verify/relative_blur.h"

namespace lensd::verify {
namespace {

constexpr double kPi = std::numbers::pi;

struct Wave {
  double fx, fy, phase, amplitude;
  double frequency() const { return std::hypot(fx, fy); }
};

/// What a disk leaves of a sinusoid: the mean of cos(2 pi f x) over its chords.
double KeptBy(double diameter, double frequency) {
  constexpr int kChords = 64;
  double sum = 0;
  for (int i = 0; i < kChords; ++i) {
    const double t = kPi * ((i + 0.5) / kChords - 0.5);
    sum += std::cos(t) * std::cos(t) * std::cos(kPi * frequency * diameter * std::sin(t));
  }
  return 2 * sum / kChords;
}

/// A sideways displacement, px.
struct Shift {
  double x = 0.0;
  double y = 0.0;
};

struct Case {
  int size = 128;
  double diameter = 1.0;
  double gain = 10.0;   // of the picture over a reference
  double full_e = 1e5;  // electrons at full scale
  double read_e = 5.0;
  int bits = 12;
  Shift shift;
  double white = 0.4;  // the picture's mean, of full scale
  double contrast = 0.1;
  std::vector<Wave> waves;

  double top() const { return (1 << bits) - 1; }
  /// Noise of a frame whose mean is `level` of full scale, as a fraction of it, rounding included.
  double VarianceAt(double level) const {
    return level / full_e + std::pow(read_e / full_e, 2) + 1 / (12 * top() * top());
  }
};

Case Drawn(std::mt19937& random, double least_diameter, double largest_diameter, double most_e = 1e6) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto between = [&](double low, double high) { return low + (high - low) * unit(random); };
  const auto log_between = [&](double low, double high) { return low * std::pow(high / low, unit(random)); };
  Case drawn;
  drawn.size = static_cast<int>(between(48, 110));
  drawn.diameter = between(least_diameter, largest_diameter);
  drawn.gain = log_between(1.0, 60.0);
  drawn.full_e = log_between(5e3, most_e);
  drawn.read_e = log_between(1.0, 20.0);
  const int bits[] = {8, 10, 12, 16};
  drawn.bits = bits[random() % 4];
  drawn.shift = {between(-1.5, 1.5), between(-1.5, 1.5)};
  drawn.contrast = log_between(0.03, 0.2);
  const double fall = between(0.5, 1.3);
  double power = 0;
  for (int i = 0; i < 80; ++i) {
    const double f = between(0.01, 0.48), angle = kPi * unit(random);
    drawn.waves.push_back({f * std::cos(angle), f * std::sin(angle), 2 * kPi * unit(random), std::pow(f, -fall)});
    power += drawn.waves.back().amplitude * drawn.waves.back().amplitude / 2;
  }
  for (Wave& wave : drawn.waves) wave.amplitude *= drawn.contrast / std::sqrt(power);
  return drawn;
}

/// A frame of that mean brightness, of full scale, blurred and displaced.
Plane FrameOf(const Case& drawn, double white, double diameter, Shift shift, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Plane plane{drawn.size, drawn.size, {}};
  std::vector<double> light(static_cast<std::size_t>(drawn.size) * drawn.size, 1.0);
  for (const Wave& wave : drawn.waves) {
    const double amplitude = wave.amplitude * KeptBy(diameter, wave.frequency());
    // cos(a + b) by rotation along the row.
    for (int y = 0; y < drawn.size; ++y) {
      const double begin = 2 * kPi * (wave.fy * (y - shift.y) - wave.fx * shift.x) + wave.phase;
      double c = amplitude * std::cos(begin), s = amplitude * std::sin(begin);
      const double turn_c = std::cos(2 * kPi * wave.fx), turn_s = std::sin(2 * kPi * wave.fx);
      for (int x = 0; x < drawn.size; ++x) {
        light[static_cast<std::size_t>(y) * drawn.size + x] += c;
        const double next = c * turn_c - s * turn_s;
        s = c * turn_s + s * turn_c;
        c = next;
      }
    }
  }
  for (const double relative : light) {
    const double level = std::max(white * relative, 0.0);
    const double noise = std::sqrt(level / drawn.full_e + std::pow(drawn.read_e / drawn.full_e, 2));
    const double sample = std::clamp((level + noise * normal(random)) * drawn.top(), 0.0, drawn.top());
    plane.values.push_back(static_cast<float>(std::round(sample)));
  }
  return plane;
}

/// The least standard error of the diameter, with texture, gain and displacement unknown, from every pixel of the
/// frames.
double CramerRao(const Case& drawn) {
  const double reference_white = drawn.white / drawn.gain;
  const double picture_variance = drawn.VarianceAt(drawn.white);
  const double reference_variance = drawn.VarianceAt(reference_white) / 2;
  double dd = 0, gg = 0, dg = 0;
  constexpr double kStep = 1e-3;
  for (const Wave& wave : drawn.waves) {
    const double f = wave.frequency(), kept = KeptBy(drawn.diameter, f);
    const double slope =
        (KeptBy(drawn.diameter + kStep, f) - KeptBy(std::abs(drawn.diameter - kStep), f)) / (2 * kStep);
    const double power = std::pow(reference_white * wave.amplitude, 2) / 2 * drawn.size * drawn.size;
    const double weight = power / (picture_variance + std::pow(drawn.gain * kept, 2) * reference_variance);
    dd += weight * std::pow(drawn.gain * slope, 2);
    gg += weight * kept * kept;
    dg += weight * drawn.gain * slope * kept;
  }
  return 1 / std::sqrt(dd - dg * dg / gg);
}

SliceBlur Measured(const Case& drawn, std::mt19937& random) {
  const double reference_white = drawn.white / drawn.gain;
  const FramesToCompare frames{FrameOf(drawn, reference_white, 0, {}, random),
                               FrameOf(drawn, reference_white, 0, {}, random),
                               FrameOf(drawn, drawn.white, drawn.diameter, drawn.shift, random)};
  const double edges[] = {1.0, 2.0};
  const auto found = BlurBetween(frames, std::vector<float>(frames.picture.values.size(), 1.5f), edges, 10.0);
  EXPECT_TRUE(found.has_value());
  return found->front();
}

struct Score {
  int cases = 0, contained = 0, told = 0, open = 0;
  std::vector<double> half_widths;  // over the bound

  void Add(const Case& drawn, const SliceBlur& blur) {
    ++cases;
    const bool contains = blur.open || (drawn.diameter >= blur.low_px && drawn.diameter <= blur.high_px);
    contained += contains ? 1 : 0;
    told += blur.at_most() ? 0 : 1;
    open += blur.open ? 1 : 0;
    half_widths.push_back((blur.high_px - blur.low_px) / 2 / CramerRao(drawn));
  }
  double Median() {
    std::ranges::nth_element(half_widths, half_widths.begin() + half_widths.size() / 2);
    return half_widths[half_widths.size() / 2];
  }
  void Print(const char* what) {
    std::printf(
        "%s: %d of %d contain the truth, %d with a lower end above 0, %d without an upper end; median half-width "
        "%.2f times the Cramer-Rao bound\n",
        what, contained, cases, told, open, Median());
  }
};

/// How many disks each test draws: 200 by script/test --long.
const int kCases = static_cast<int>(testing::ByLevel(30, 30, 200));

/// At least so many bars of 95 % contain the truth: 2.35 standard deviations fewer than on average.
const int kContained = static_cast<int>(testing::ByLevel(26, 26, 183));

/// Of kCases disks of `low` to `high` px that the frames can tell.
Score ScoreOf(unsigned seed, double low, double high) {
  std::mt19937 random(seed);
  Score score;
  while (score.cases < kCases) {
    const Case drawn = Drawn(random, low, high);
    if (CramerRao(drawn) > 0.1) continue;
    score.Add(drawn, Measured(drawn, random));
  }
  return score;
}

// How wide the bars are beside the bound, and how often there is no upper end, is printed and not judged: the goals
// (2.5 times the bound, an upper end nearly always) are not met yet (docs/plan.md).
TEST(BlurCoverage, ErrorBarsContainTheTruth) {
  Score score = ScoreOf(20261122, 0.3, 8.0);
  score.Print("0.3 to 8 px");
  EXPECT_GE(score.contained, kContained);
}

TEST(BlurCoverage, ErrorBarsOfSmallDisksContainTheTruth) {
  Score score = ScoreOf(303, 0.3, 1.0);
  score.Print("0.3 to 1 px");
  EXPECT_GE(score.contained, kContained);
}

TEST(BlurCoverage, SaysAtMostWhereTheFramesCannotTell) {
  std::mt19937 random(404);
  Score score;
  int told = 0;
  while (score.cases < kCases && told < 4 * kCases) {
    const Case drawn = Drawn(random, 0.0, 0.6, 3e4);
    const SliceBlur blur = Measured(drawn, random);
    if (blur.at_most()) {
      score.Add(drawn, blur);
    } else {
      ++told;
    }
  }
  score.Print("at most");
  EXPECT_EQ(score.cases, kCases);
  EXPECT_GE(score.contained, kContained);
}

}  // namespace
}  // namespace lensd::verify
