// The coefficient of focus by temperature: what it promises of samples that are drawn about a truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "io/toml.h"
#include "rig/focus_drift.h"

namespace lensd::rig {
namespace {

constexpr double kUm = 1e-6;

struct Drawn {
  int subjects = 1;
  int each = 6;
  double claimed = 1.0;  ///< sigma told over sigma true
  double uneven = 0.0;   ///< sigmas from 1 to 1 + that times as large
};

/// Focus loses `per_degree` um for each degree, in subjects at places of their own.
std::vector<DriftSample> Draw(std::mt19937_64& random, const Drawn& how, double per_degree) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<DriftSample> samples;
  for (int subject = 1; subject <= how.subjects; ++subject) {
    const double place = 300.0 + 200.0 * uniform(random);
    for (int i = 0; i < how.each; ++i) {
      const double sigma = 0.8 * (1.0 + how.uneven * uniform(random));
      const double temperature = 15.0 + 10.0 * (i + uniform(random)) / how.each;
      samples.push_back({.subject = subject,
                         .temperature = Celsius{temperature},
                         .extension = Metres{kUm * (place - per_degree * temperature + sigma * normal(random))},
                         .sigma = Metres{kUm * how.claimed * sigma}});
    }
  }
  return samples;
}

void HoldsAsOftenAsItSays(const Drawn& how, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  constexpr int kRuns = 300;
  int held = 0, outliers = 0;
  double half = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    auto samples = Draw(random, how, 3.7);
    const auto drift = FitFocusDrift(samples);
    ASSERT_TRUE(drift) << drift.error().message;
    held += drift->low.value <= 3.7 * kUm && 3.7 * kUm <= drift->high.value;
    half += (drift->high.value - drift->low.value) / 2.0 / kUm / kRuns;
    for (const DriftSample& sample : samples) outliers += sample.outlier;
  }
  std::printf("%d of %d intervals of 95 %% hold, half-width %.3f um/C; %d of %d samples told as outliers\n", held,
              kRuns, half, outliers, kRuns * how.subjects * how.each);
  EXPECT_GE(held, 0.93 * kRuns);
  EXPECT_LE(held, 0.99 * kRuns);
}

TEST(FocusDrift, NinetyFivePercentHold) {
  HoldsAsOftenAsItSays({.subjects = 1, .each = 6}, 1);
  HoldsAsOftenAsItSays({.subjects = 1, .each = 20, .uneven = 3.0}, 2);
  HoldsAsOftenAsItSays({.subjects = 4, .each = 3}, 3);
  // Sigmas that are all told three times too small or too large.
  HoldsAsOftenAsItSays({.subjects = 2, .each = 6, .claimed = 0.33}, 4);
  HoldsAsOftenAsItSays({.subjects = 2, .each = 6, .claimed = 3.0}, 5);
}

TEST(FocusDrift, ResultsThatDoNotBelongAreNamed) {
  std::mt19937_64 random(7);
  int named = 0, others = 0, held = 0;
  constexpr int kRuns = 100;
  for (int run = 0; run < kRuns; ++run) {
    auto samples = Draw(random, {.each = 12}, -2.0);
    samples[5].extension.value += 20.0 * kUm;  // another subject
    samples[10].temperature.value += 12.0;     // a wrong reading
    const auto drift = FitFocusDrift(samples);
    ASSERT_TRUE(drift);
    for (std::size_t i = 0; i < samples.size(); ++i) (i == 5 || i == 10 ? named : others) += samples[i].outlier;
    held += drift->low.value <= -2.0 * kUm && -2.0 * kUm <= drift->high.value;
  }
  std::printf("%d of %d wrong results named, %d of %d others; %d of %d intervals hold\n", named, 2 * kRuns, others,
              10 * kRuns, held, kRuns);
  EXPECT_GE(named, 195);
  EXPECT_LE(others, 20);
  EXPECT_GE(held, 90);
}

TEST(FocusDrift, TooLittleIsSaid) {
  std::mt19937_64 random(3);
  auto few = Draw(random, {.subjects = 2, .each = 2}, 1.0);
  ASSERT_FALSE(FitFocusDrift(few));
  EXPECT_THAT(FitFocusDrift(few).error().message, ::testing::HasSubstr("needs 2 more autofocus results"));
  auto once_each = Draw(random, {.subjects = 30, .each = 1}, 1.0);
  EXPECT_EQ(FitFocusDrift(once_each).error().code, Code::OutOfRange);
  auto even = Draw(random, {.each = 10}, 1.0);
  for (DriftSample& sample : even) sample.temperature = Celsius{20.0 + 0.1 * (sample.temperature.value - 20.0)};
  EXPECT_THAT(FitFocusDrift(even).error().message, ::testing::HasSubstr("and it takes 2 C"));
  std::vector<DriftSample> none;
  EXPECT_FALSE(FitFocusDrift(none));
}

TEST(FocusDrift, ItsFileReadsBack) {
  std::mt19937_64 random(4);
  auto samples = Draw(random, {.subjects = 2, .each = 5}, 1.0);
  samples.front().made = "2026-11-25T16:00:00Z";
  const auto settings = io::ParseToml(FocusDriftText(samples), "cam.refocus.toml");
  ASSERT_TRUE(settings);
  const auto read = ReadFocusDrift(*settings);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ((*read)[i].subject, samples[i].subject);
    EXPECT_EQ((*read)[i].temperature, samples[i].temperature);
    EXPECT_NEAR((*read)[i].extension.value, samples[i].extension.value, 1e-15);
    EXPECT_NEAR((*read)[i].sigma.value, samples[i].sigma.value, 1e-15);
    EXPECT_EQ((*read)[i].made, samples[i].made);
  }
  EXPECT_EQ(FocusDriftText({}), "");
  const auto wrong = io::ParseToml("version = 1\n[[result]]\ntemperature_c = 1\nextension_um = 2\nsigma_um = 0\n", "f");
  EXPECT_THAT(ReadFocusDrift(*wrong).error().message, ::testing::HasSubstr("f:5"));
  const auto empty = io::ParseToml("", "f");
  EXPECT_THAT(ReadFocusDrift(*empty).error().message, ::testing::HasSubstr("version = 1"));
}

}  // namespace
}  // namespace lensd::rig
