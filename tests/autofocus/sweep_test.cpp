// The sweep and the session around it, fed with frames of known sharpness: no lens, no camera, no clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "autofocus/peak_fit.h"
#include "autofocus/session.h"

namespace lensd::autofocus {
namespace {

constexpr int kSize = 64;
constexpr drivers::Region kWhole{0.0, 0.0, 1.0, 1.0};

/// A picture: light in 0..1 from pixel and random number, quantised to 12 bits.
drivers::Frame FrameOf(const std::function<double(int x, int y)>& light, double noise, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  auto samples = std::make_shared<std::vector<std::uint16_t>>();
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double value = light(x, y) + noise * normal(random);
      samples->push_back(static_cast<std::uint16_t>(std::clamp(value * 4095.0 + 0.5, 0.0, 4095.0)));
    }
  }
  drivers::Frame frame;
  frame.width = frame.height = kSize;
  frame.bits = 12;
  frame.samples = samples;
  return frame;
}

/// A checked texture whose contrast falls with the blur as a Gaussian.
struct Scene {
  double sharp_at = 0.5e-3;  // metres of extension
  double blur_px = 7e-6;     // metres of extension a pixel of blur
  double width_px = 3.0;     // standard deviation of that Gaussian
  double contrast = 0.3;
  double noise = 0.01;
  double exposure_scatter = 0.0;
  double slope = 0.0;  // of a ramp of light across the frame that no focus changes

  drivers::Frame At(double position, std::mt19937& random) const {
    const double blur = (position - sharp_at) / blur_px;
    const double seen = contrast * (0.05 + 0.95 * std::exp(-0.5 * std::pow(blur / width_px, 2)));
    const double exposure = 1.0 + exposure_scatter * std::normal_distribution<double>(0.0, 1.0)(random);
    constexpr int kMiddle = kSize / 2;
    const auto light = [&](int x, int y) {
      const double check = ((x / 2 + y / 2) % 2 == 0 ? 0.5 : -0.5) * seen;
      return exposure * (0.4 + 0.4 * check + slope * (x - kMiddle));
    };
    return FrameOf(light, noise, random);
  }
};

struct End {
  Verdict verdict;
  std::vector<double> visited;
};

Setup Calibrated() {
  return {.lowest = 0.0, .highest = 1e-3, .resolution = 0.25e-6, .blur_px = 7e-6, .ascending = true};
}

End Drive(const Scene& scene, const Setup& setup, double start, unsigned seed, double backlash = 0.0,
          std::string_view method = "sweep") {
  std::mt19937 random(seed);
  auto session = Session::Create(method, setup);
  EXPECT_TRUE(session);
  End end;
  double position = start;
  for (int frames = 0; frames < 500; ++frames) {
    end.visited.push_back(position);
    // Backlash: a lens that arrives going down is not quite there.
    const bool came_down = end.visited.size() > 1 && position < end.visited[end.visited.size() - 2];
    const auto advice = session->Next(position, scene.At(position + (came_down ? backlash : 0.0), random), kWhole);
    EXPECT_TRUE(advice);
    if (const auto* verdict = std::get_if<Verdict>(&*advice)) {
      end.verdict = *verdict;
      return end;
    }
    position = std::get<GoAndLook>(*advice).position;
    EXPECT_GE(position, setup.lowest);
    EXPECT_LE(position, setup.highest);
  }
  ADD_FAILURE() << "never came to an end";
  return end;
}

// Half a depth of field is two pixels of blur; over 100 subjects none may be missed, and the claimed sigma must be
// honest.
TEST(SweepTest, FindsSubjectsAnywhere) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(0.03e-3, 0.97e-3);
  double squared = 0.0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Scene scene;
    scene.sharp_at = anywhere(random);
    const End end = Drive(scene, Calibrated(), anywhere(random), seed);
    ASSERT_TRUE(end.verdict.focused) << scene.sharp_at << ": " << end.verdict.reason;
    const double error = end.verdict.position - scene.sharp_at;
    EXPECT_LT(std::abs(error), 1.0 * scene.blur_px) << scene.sharp_at;
    squared += std::pow(error / end.verdict.sigma, 2);
    EXPECT_EQ(end.visited.back(), end.verdict.position);
  }
  EXPECT_LT(std::sqrt(squared / 100), 3.0);
}

TEST(SweepTest, ExposureThatWandersDoesNotMislead) {
  Scene scene;
  scene.exposure_scatter = 0.1;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const End end = Drive(scene, Calibrated(), 0.2e-3, seed);
    ASSERT_TRUE(end.verdict.focused) << end.verdict.reason;
    EXPECT_LT(std::abs(end.verdict.position - scene.sharp_at), 2.0 * scene.blur_px);
  }
}

TEST(SweepTest, EveryPassRunsTheSameWay) {
  for (const bool ascending : {true, false}) {
    autofocus::Setup setup = Calibrated();
    setup.ascending = ascending;
    const auto visited = Drive({}, setup, 0.2e-3, 1).visited;
    // The first frame, three passes and the check: only their beginnings may go the other way.
    int turns = 0;
    for (std::size_t i = 2; i < visited.size(); ++i) turns += (visited[i] > visited[i - 1]) != ascending;
    EXPECT_LE(turns, 3);
  }
}

TEST(SweepTest, WithoutOpticsTheStepFollowsTheCurve) {
  autofocus::Setup setup{.lowest = 0.0, .highest = 4000.0, .resolution = 1.0, .blur_px = {}, .ascending = true};
  Scene scene;
  scene.sharp_at = 1234.0;
  scene.blur_px = 28.0;
  const End end = Drive(scene, setup, 3000.0, 1);
  ASSERT_TRUE(end.verdict.focused) << end.verdict.reason;
  EXPECT_NEAR(end.verdict.position, 1234.0, 56.0);
}

TEST(SweepTest, RefusesWhatDoesNotChangeWithFocus) {
  Scene blank, ramp, drowned;
  blank.contrast = 0.0;
  ramp.contrast = 0.0;
  ramp.slope = 0.006;
  drowned.contrast = 0.002;
  drowned.noise = 0.1;
  int refused = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    for (const Scene& scene : {blank, ramp, drowned}) {
      const End end = Drive(scene, Calibrated(), 0.2e-3, seed);
      refused += !end.verdict.focused && !end.verdict.reason.empty();
    }
  }
  EXPECT_EQ(refused, 90);
}

TEST(SweepTest, TellsTheEndOfTheRangeFromWhatLiesBeyond) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    Scene at_end, beyond;
    at_end.sharp_at = 1e-3;
    beyond.sharp_at = 1e-3 + 5 * beyond.blur_px;
    const End reached = Drive(at_end, Calibrated(), 0.2e-3, seed);
    ASSERT_TRUE(reached.verdict.focused) << reached.verdict.reason;
    EXPECT_NEAR(reached.verdict.position, 1e-3, 1.5 * at_end.blur_px);
    EXPECT_FALSE(Drive(beyond, Calibrated(), 0.2e-3, seed).verdict.focused);
  }
}

// On one broad hill every search gets there; where the hill is narrow on a wide plain some lose it, and then say so.
TEST(SearchesTest, ClimbTheHillOrSayThatTheyDidNot) {
  for (const auto name : MethodNames()) {
    if (name == "auto" || name == "defocus" || name == "sweep" || name == "moving" || name == "stars")
      continue;  // they know that no lens makes such a hill
    int found = 0;
    for (unsigned seed = 0; seed < 8; ++seed) {
      Scene broad, narrow;
      broad.sharp_at = narrow.sharp_at = 0.2e-3 + 0.07e-3 * seed;
      broad.width_px = 15.0;
      broad.noise = narrow.noise = 0.002;
      const End end = Drive(broad, Calibrated(), 0.7e-3, seed, 0.0, name);
      found += end.verdict.focused && std::abs(end.verdict.position - broad.sharp_at) < 4 * broad.blur_px;
      const End lost = Drive(narrow, Calibrated(), 0.7e-3, seed, 0.0, name);
      if (lost.verdict.focused) {
        EXPECT_LT(std::abs(lost.verdict.position - narrow.sharp_at), 4 * narrow.blur_px) << name;
      }
    }
    EXPECT_GE(found, 7) << name;
  }
}

// The session's own checks need no method's help.
TEST(SessionTest, AnAnswerThatDoesNotHoldIsARefusal) {
  // The last way to the answer goes down and leaves the lens 20 px of blur away from it.
  const End end = Drive({}, Calibrated(), 0.2e-3, 1, 140e-6);
  EXPECT_FALSE(end.verdict.focused);
  EXPECT_EQ(end.verdict.confidence, 0.0);
  EXPECT_NE(end.verdict.reason, "");
}

TEST(SessionTest, KnowsItsMethodsAndItsWindow) {
  EXPECT_EQ(Session::Create("guess", Calibrated()).error().code, Code::InvalidArgument);
  for (const auto name : MethodNames()) {
    EXPECT_EQ(Session::Create(name, Calibrated()).has_value(), name != "moving") << name;
  }
  autofocus::Setup moves = Calibrated();
  moves.stride = 20e-6;
  EXPECT_TRUE(Session::Create("moving", moves));
  EXPECT_EQ(*WindowOf({0.25, 0.5, 0.5, 0.25}, 640, 480), (Window{160, 240, 320, 120}));
  EXPECT_FALSE(WindowOf({0.9, 0.0, 0.2, 0.2}, 640, 480));
  EXPECT_FALSE(WindowOf({0.0, 0.0, 0.02, 0.2}, 640, 480));
  EXPECT_FALSE(WindowOf({-0.1, 0.0, 0.5, 0.5}, 640, 480));
}

TEST(PeakFitTest, FindsTheVertexOfAGaussianExactly) {
  std::vector<CurvePoint> points;
  for (const double x : {-1.0, 0.0, 1.0, 2.0}) {
    const double value = 5.0 * std::exp(-0.5 * std::pow((x - 0.3) / 1.7, 2));
    points.push_back({x, value, 0.01 * value});
  }
  const auto fit = FitPeak(points);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->position, 0.3, 1e-12);
}

// Long tails and unlike sides: the curve's own power finds the top, a Gaussian is off by more than a tenth of its
// width.
TEST(PeakFitTest, FindsTheVertexOfACurveWithLongTailsByItsPower) {
  for (const double power : {-0.5, -0.6, -1.0}) {
    std::vector<CurvePoint> points;
    for (const double x : {-9.0, 0.5, 5.7}) {
      const double value = 4.0 * std::pow(1.0 + std::pow((x - 0.3) / 3.0, 2), 1.0 / power);
      points.push_back({x, value, 0.03 * value});
    }
    const auto fit = FitPeak(points, power);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->position, 0.3, 1e-9) << power;
    EXPECT_NEAR(fit->height, 4.0, 1e-9) << power;
    EXPECT_GT(std::abs(FitPeak(points)->position - 0.3), 0.3) << power;
  }
}

TEST(PeakFitTest, ItsSigmaIsTheScatterOfItsAnswers) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  double squared = 0.0, claimed = 0.0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    std::vector<CurvePoint> points;
    for (int x = -3; x <= 3; ++x) {
      const double value = std::exp(-0.5 * std::pow((x - 0.2) / 2.0, 2));
      points.push_back({static_cast<double>(x), value + 0.02 * normal(random), 0.02});
    }
    const auto fit = FitPeak(points);
    ASSERT_TRUE(fit);
    squared += std::pow(fit->position - 0.2, 2) / kTrials;
    claimed += fit->sigma / kTrials;
  }
  EXPECT_NEAR(claimed / std::sqrt(squared), 1.1, 0.25);
}

TEST(PeakFitTest, AValleyOrTwoPointsAreNoPeak) {
  EXPECT_FALSE(FitPeak(std::vector<CurvePoint>{{0, 2, 0.1}, {1, 1, 0.1}, {2, 2, 0.1}}));
  EXPECT_FALSE(FitPeak(std::vector<CurvePoint>{{0, 1, 0.1}, {1, 2, 0.1}}));
}

}  // namespace
}  // namespace lensd::autofocus
