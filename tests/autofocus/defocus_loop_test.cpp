// Depth from defocus in a closed loop: a simulated lens, its mechanics and noise, a renderer that shares nothing with
// the estimator, textures not tuned on, and truth that only the score sees.
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

/// What the rig believes wrongly, and how late it hears of its lens.
struct Wrong {
  double f_number = 1.0;
  double focal_length = 1.0;
  Duration late{};
};

std::vector<AutofocusRunResult> Score(const std::string& scene, const Wrong& wrong = {},
                                      long runs = testing::ByLevel(4, 30, 1000), std::uint64_t seed = 90) {
  auto loaded = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/score/" + scene + ".toml");
  EXPECT_TRUE(loaded) << loaded.error().message;
  auto pictures = sim::Pictures::Create(std::make_shared<const sim::Scene>(*std::move(loaded)));
  EXPECT_TRUE(pictures) << pictures.error().message;
  auto results = RunAutofocus(*pictures, {.method = "auto",
                                          .runs = static_cast<int>(runs),
                                          .seed = seed,
                                          .f_number_error = wrong.f_number,
                                          .focal_length_error = wrong.focal_length,
                                          .late = wrong.late});
  EXPECT_TRUE(results) << results.error().message;
  const AutofocusSummary summary = Summarise(scene, *results);
  std::printf("%s: %d runs, within %.2f %% (95 %% sure of %.2f %%), false %.2f %%, refused %.2f %%\n", scene.c_str(),
              summary.runs, 100 * summary.within, 100 * summary.within_low, 100 * summary.false_focus,
              100 * summary.refused);
  return *results;
}

int Quantile(const std::vector<AutofocusRunResult>& runs, int AutofocusRunResult::* count, double quantile) {
  std::vector<int> counts;
  for (const AutofocusRunResult& run : runs) counts.push_back(run.*count);
  std::ranges::sort(counts);
  return counts[static_cast<std::size_t>(quantile * static_cast<double>(counts.size() - 1))];
}

int Frames(const std::vector<AutofocusRunResult>& runs, double quantile) {
  return Quantile(runs, &AutofocusRunResult::frames, quantile);
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

TEST_P(DefocusLoop, FocusesOrdinaryScenesInFiveFrames) {
  const auto runs = Score(GetParam());
  ExpectRates(runs, 0.005, 0.001);
  EXPECT_LE(Frames(runs, 0.9), 6);
  if (runs.size() >= 30) {  // the median of fewer is a coin toss where four, five and six frames are about as likely
    EXPECT_LE(Frames(runs, 0.5), 5);
    EXPECT_LE(Quantile(runs, &AutofocusRunResult::moves, 0.5), 4);
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
    const auto runs = Score(texture, {}, testing::ByLevel(1, 5, 500), 91);
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
  const auto runs = Score("foliage", {.f_number = 1.1});
  ExpectRates(runs, 0.02, 0.005);
}

TEST(DefocusLoopTest, FocusesAHexagonalApertureThatBreathesWithAllOpticsWrong) {
  for (const char* scene : {"ground-perturbed", "foliage-perturbed", "plaster-perturbed"}) {
    const auto runs = Score(scene, {.f_number = 1.1, .focal_length = 1.05}, testing::ByLevel(2, 20, 1000));
    ExpectRates(runs, 0.02, 0.005);
  }
}

TEST(DefocusLoopTest, BacklashAndLateReadingsTogetherCostNothing) {
  const auto runs = Score("ground-backlash", {.late = std::chrono::milliseconds(10)});
  ExpectRates(runs, 0.005, 0.001);
  if (runs.size() >= 30) {
    EXPECT_LE(Frames(runs, 0.5), 5);
    EXPECT_LE(Quantile(runs, &AutofocusRunResult::moves, 0.5), 4);
  }
}

}  // namespace
}  // namespace lensd::bench
