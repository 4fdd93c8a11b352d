// Depth from defocus in a closed loop: a simulated lens, its mechanics and noise, a renderer that shares nothing with
// the estimator, textures nobody tuned on, and truth that only the score sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/autofocus/runs.h"
#include "bench/autofocus/summary.h"
#include "sim/scene.h"
#include "test_level.h"

namespace lensd::bench {
namespace {

constexpr const char* kTextures[] = {"ground", "leaves", "foliage", "page", "cloth", "plaster"};

std::vector<AutofocusRunResult> Score(const std::string& scene, double f_number_error = 1.0,
                                      long runs = testing::ByLevel(4, 30, 1000), std::uint64_t seed = 90) {
  auto loaded = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/score/" + scene + ".toml");
  EXPECT_TRUE(loaded) << loaded.error().message;
  auto pictures = sim::Pictures::Create(std::make_shared<const sim::Scene>(*std::move(loaded)));
  EXPECT_TRUE(pictures) << pictures.error().message;
  auto results = RunAutofocus(
      *pictures, {.method = "auto", .runs = static_cast<int>(runs), .seed = seed, .f_number_error = f_number_error});
  EXPECT_TRUE(results) << results.error().message;
  const AutofocusSummary summary = Summarise(scene, *results);
  std::printf("%s: %d runs, within %.2f %% (95 %% sure of %.2f %%), false %.2f %%, refused %.2f %%\n", scene.c_str(),
              summary.runs, 100 * summary.within, 100 * summary.within_low, 100 * summary.false_focus,
              100 * summary.refused);
  return *results;
}

int Frames(const std::vector<AutofocusRunResult>& runs, double quantile) {
  std::vector<int> frames;
  for (const AutofocusRunResult& run : runs) frames.push_back(run.frames);
  std::ranges::sort(frames);
  return frames[static_cast<std::size_t>(quantile * static_cast<double>(frames.size() - 1))];
}

/// As many events as a method of that rate shows at most, but for once in 700 times: three standard deviations.
double AtMost(double rate, std::size_t runs) {
  const double expected = rate * static_cast<double>(runs);
  return expected + 3.0 * std::sqrt(expected);
}

void ExpectRates(const std::vector<AutofocusRunResult>& runs, double miss_rate, double false_rate) {
  const auto missed = std::ranges::count_if(runs, [](const AutofocusRunResult& run) { return !run.within(); });
  const auto wrong = std::ranges::count_if(runs, &AutofocusRunResult::false_focus);
  EXPECT_LE(static_cast<double>(missed), AtMost(miss_rate, runs.size())) << "of " << runs.size();
  EXPECT_LE(static_cast<double>(wrong), AtMost(false_rate, runs.size())) << "of " << runs.size();
}

class DefocusLoop : public ::testing::TestWithParam<const char*> {};

TEST_P(DefocusLoop, FocusesOrdinaryScenesInThreeFrames) {
  const auto runs = Score(GetParam());
  ExpectRates(runs, 0.005, 0.001);
  EXPECT_LE(Frames(runs, 0.9), 6);
  if (runs.size() >= 30) {  // the median of fewer is a coin toss where three and four frames are about as likely
    EXPECT_LE(Frames(runs, 0.5), 3);
  }
}

INSTANTIATE_TEST_SUITE_P(Ordinary, DefocusLoop,
                         ::testing::Values("ground", "leaves", "foliage", "page", "cloth", "plaster",
                                           "ground-backlash"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// At most one run in a thousand, on all ordinary scenes together.
TEST(DefocusLoopTest, FalseFocusIsRare) {
  std::size_t all = 0, wrong = 0;
  for (const char* texture : kTextures) {
    const auto runs = Score(texture, 1.0, testing::ByLevel(1, 5, 500), 91);
    all += runs.size();
    wrong += static_cast<std::size_t>(std::ranges::count_if(runs, &AutofocusRunResult::false_focus));
  }
  EXPECT_LE(static_cast<double>(wrong), 0.001 * static_cast<double>(all)) << "of " << all;
}

TEST(DefocusLoopTest, FocusesInLowLight) {
  const auto runs = Score("plaster-dim");
  ExpectRates(runs, 0.03, 0.001);
  EXPECT_LE(Frames(runs, 0.5), 5);
}

TEST(DefocusLoopTest, FocusesWithAnApertureThatIsNotWhatItSays) {
  const auto runs = Score("foliage", 1.1);
  ExpectRates(runs, 0.02, 0.005);
}

}  // namespace
}  // namespace lensd::bench
