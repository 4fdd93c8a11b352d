// Depth from defocus in a closed loop: a simulated lens, its mechanics and noise, a renderer that shares nothing with
// the estimator, textures nobody tuned on, and truth that only the score sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/autofocus/runs.h"
#include "sim/scene.h"
#include "test_level.h"

namespace lensd::bench {
namespace {

std::vector<AutofocusRunResult> Score(const std::string& scene, double f_number_error = 1.0) {
  auto loaded = sim::LoadScene(std::string(LENSD_SOURCE_DIR) + "/scenes/score/" + scene + ".toml");
  EXPECT_TRUE(loaded) << loaded.error().message;
  auto pictures = sim::Pictures::Create(std::make_shared<const sim::Scene>(*std::move(loaded)));
  EXPECT_TRUE(pictures) << pictures.error().message;
  const int runs = static_cast<int>(testing::ByLevel(6, 50, 1000));
  auto results =
      RunAutofocus(*pictures, {.method = "auto", .runs = runs, .seed = 90, .f_number_error = f_number_error});
  EXPECT_TRUE(results) << results.error().message;
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
  EXPECT_LE(Frames(runs, 0.5), 3);
  EXPECT_LE(Frames(runs, 0.9), 6);
}

INSTANTIATE_TEST_SUITE_P(Ordinary, DefocusLoop, ::testing::Values("ground", "leaves", "ground-backlash"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

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
