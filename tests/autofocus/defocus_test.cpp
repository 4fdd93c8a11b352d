// The defocus estimator against frames whose blur is known in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "autofocus/defocus/defocus.h"
#include "autofocus/defocus/posterior.h"
#include "autofocus/session.h"
#include "defocus_scene.h"
#include "test_level.h"
#include "whole_search.h"

namespace lensd::autofocus {
namespace {

using testing::Ending;
using testing::NaturalWaves;
using testing::Picture;
using testing::Wave;

struct Estimate {
  double focus = 0.0;
  double sigma = 0.0;
};

/// From frames at `positions` of a subject in focus at `focus`, all in pixels of blur.
Estimate EstimateFrom(const std::vector<Wave>& waves, double focus, const std::vector<double>& positions, double noise,
                      unsigned seed, double slope = 1.0) {
  std::vector<defocus::Tiles> spectra;
  for (const double position : positions) {
    const auto frame = Picture(waves, slope * (position - focus), noise, seed++);
    spectra.push_back({defocus::SpectrumOf(frame, {0, 0, frame.width, frame.height})});
  }
  std::vector<const defocus::Tiles*> pointers;
  for (const auto& spectrum : spectra) pointers.push_back(&spectrum);
  const auto stack = defocus::StackRings(pointers);
  const defocus::Posterior posterior(defocus::Likelihood(stack, positions), {-60.0, 60.0});
  return {posterior.focus(), posterior.sigma()};
}

TEST(DefocusEstimate, TwoFramesGiveSizeAndSide) {
  for (const double focus : {-30.0, -17.0, -9.0, 4.0, 13.0, 26.0}) {
    const Estimate estimate = EstimateFrom(NaturalWaves(11), focus, {0.0, 10.0}, 0.005, 5);
    EXPECT_NEAR(estimate.focus, focus, 0.06 * std::abs(focus) + 0.3);
  }
}

TEST(DefocusEstimate, AThirdFrameNearbyRemovesTheErrorOfTheSlope) {
  for (const double slope : {0.9, 1.0, 1.1}) {
    const Estimate estimate = EstimateFrom(NaturalWaves(12), 20.0, {0.0, 12.0, 20.6}, 0.005, 6, slope);
    EXPECT_NEAR(estimate.focus, 20.0, 0.4) << slope;
  }
}

TEST(DefocusEstimate, TruthLiesWithinThreeSigma) {
  const long trials = lensd::testing::ByLevel(20, 60, 1000);
  long inside = 0;
  std::mt19937 random(2024);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (long i = 0; i < trials; ++i) {
    const auto seed = static_cast<unsigned>(1000 + 10 * i);
    const double focus = -25.0 + 50.0 * uniform(random);
    const double offset = -0.8 + 1.6 * uniform(random);
    const auto waves = NaturalWaves(seed, 2.0 + 0.8 * uniform(random), 250);
    const Estimate estimate = EstimateFrom(waves, focus, {0.0, 10.0, focus + offset}, 0.01, seed);
    inside += std::abs(estimate.focus - focus) <= 3.0 * estimate.sigma + 1e-9;
  }
  // 99 % at least: of 60 trials, three outside would have a chance of 2 % at exactly that rate.
  EXPECT_GE(static_cast<double>(inside), 0.99 * static_cast<double>(trials) - 1.5) << inside << " of " << trials;
}

/// Within three depths of field.
bool SeenOnBothSides(const Ending& run) {
  bool below = false, above = false;
  for (const double position : run.visited) {
    const double off = position - run.verdict.position;
    below |= off < -2.0 && off >= -12.0;
    above |= off > 2.0 && off <= 12.0;
  }
  return below && above;
}
/// Drives the method itself until its verdict. `picture`: of a position, for the n-th frame.
template <class Picturer>
Ending RunOn(const Picturer& picture, double start, double highest = 60.0) {
  Defocus method({.lowest = -60.0, .highest = highest, .resolution = 0.02, .blur_px = 1.0, .ascending = true});
  Ending run;
  double position = start;
  while (true) {
    const auto frame = picture(position, ++run.frames);
    run.visited.push_back(position);
    const Window window{0, 0, frame.width, frame.height};
    const Advice advice =
        method.Next({.position = position, .frame = &frame, .window = window, .score = *ScoreFocus(frame, window)});
    if (const auto* verdict = std::get_if<Verdict>(&advice)) {
      run.verdict = *verdict;
      return run;
    }
    position = std::get<GoAndLook>(advice).position;
    EXPECT_GE(position, -60.0);
    EXPECT_LE(position, highest);
    if (run.frames > 20) return run;
  }
}

/// The same through a session.
template <class Picturer>
Ending RunSession(std::string_view name, const Picturer& picture, double start) {
  const Setup setup{.lowest = -60.0, .highest = 60.0, .resolution = 0.02, .blur_px = 1.0, .ascending = true};
  return testing::SearchWith(name, setup, start, picture);
}

Ending RunOn(const std::vector<Wave>& waves, double start, double focus, double noise, double highest = 60.0) {
  const auto picture = [&](double position, int n) {
    return Picture(waves, position - focus, noise, static_cast<unsigned>(77 + n));
  };
  return RunOn(picture, start, highest);
}

/// The scene moved sideways by so many px.
std::vector<Wave> Moved(std::vector<Wave> waves, double x, double y) {
  for (Wave& wave : waves) wave.phase -= 2.0 * std::numbers::pi * (wave.fx * x + wave.fy * y);
  return waves;
}

TEST(DefocusMethod, UndoesMotionSideways) {
  for (const double step : {0.7, 1.5, 2.5}) {
    const auto waves = NaturalWaves(26);
    const auto picture = [&](double position, int n) {
      return Picture(Moved(waves, step * n, -0.5 * step * n), position - 3.0, 0.005, static_cast<unsigned>(n));
    };
    const Ending run = RunOn(picture, -20.0);
    EXPECT_TRUE(run.verdict.focused) << step << ": " << run.verdict.reason;
    EXPECT_NEAR(run.verdict.position, 3.0, 2.0) << step;
  }
}

TEST(DefocusMethod, AnotherSceneInEveryFrameIsNotMistakenForBlur) {
  int refused_for_motion = 0;
  for (const unsigned seed : {40u, 60u, 80u}) {
    const auto picture = [&](double position, int n) {
      const auto waves = NaturalWaves(seed + static_cast<unsigned>(n), n % 2 == 0 ? 1.4 : 3.4);
      return Picture(waves, position, 0.005, static_cast<unsigned>(n));
    };
    const Ending run = RunOn(picture, -20.0);
    EXPECT_FALSE(run.verdict.focused) << run.verdict.position;
    refused_for_motion += run.verdict.reason.find("moved between") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(refused_for_motion, 1);
}

TEST(ShiftBetween, FindsWhatMovedAndSaysWhatIsAnotherPicture) {
  const auto waves = NaturalWaves(30);
  const auto spectrum = [](const std::vector<Wave>& scene, double blur, unsigned seed) {
    return defocus::Tiles{defocus::SpectrumOf(Picture(scene, blur, 0.01, seed), {0, 0, 192, 192})};
  };
  const auto still = spectrum(waves, 4.0, 1);
  const auto moved = defocus::ShiftBetween(still, spectrum(Moved(waves, 3.3, -1.6), 9.0, 2));
  EXPECT_TRUE(moved.clear);
  EXPECT_FALSE(moved.lost);
  EXPECT_NEAR(moved.x, -3.3, 0.25);
  EXPECT_NEAR(moved.y, 1.6, 0.25);
  EXPECT_FALSE(defocus::ShiftBetween(still, spectrum(waves, 12.0, 3)).clear);
  EXPECT_TRUE(defocus::ShiftBetween(still, spectrum(NaturalWaves(31), 4.0, 4)).lost);
}

TEST(ShiftBetween, APatternTurnedRoundByBlurHasNotMoved) {
  const std::vector<Wave> waves{{.fx = 0.125, .fy = 0.0, .phase = 0.3, .amplitude = 0.4}};
  const auto spectrum = [&](double blur, unsigned seed) {
    return defocus::Tiles{defocus::SpectrumOf(Picture(waves, blur, 0.001, seed), {0, 0, 192, 192})};
  };
  const auto near = spectrum(3.0, 1), reversed = spectrum(13.0, 2);  // 2 J1(x)/x is 0.84 and -0.13
  const auto shift = defocus::ShiftBetween(near, reversed);
  EXPECT_FALSE(shift.clear) << shift.x << ", " << shift.y;
  EXPECT_FALSE(shift.lost);
  EXPECT_FALSE(shift.unlike);
}

TEST(DefocusMethod, FindsOneOfSeveralDepthsOrNamesThem) {
  const auto left = NaturalWaves(28), right = NaturalWaves(29);
  const auto picture = [&](double position, int n) {
    auto frame = Picture(left, position, 0.005, static_cast<unsigned>(n));
    const auto other = Picture(right, position - 16.0, 0.005, static_cast<unsigned>(100 + n));
    auto samples = *frame.samples;
    for (int y = 0; y < frame.height; ++y) {
      for (int x = frame.width / 2; x < frame.width; ++x) {
        const auto at = static_cast<std::size_t>(y * frame.width + x);
        samples[at] = (*other.samples)[at];
      }
    }
    frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
    return frame;
  };
  int named = 0;
  for (const double start : {-40.0, -20.0, 8.0, 36.0}) {
    const Verdict verdict = RunSession("auto", picture, start).verdict;
    const auto& found = verdict.candidates;
    const bool names =
        found.size() > 1 && std::abs(found[0].position) < 4.0 && std::abs(found.back().position - 16.0) < 4.0;
    const double off = std::min(std::abs(verdict.position), std::abs(verdict.position - 16.0));
    EXPECT_TRUE(verdict.focused ? off < 1.0 : names && verdict.cause == Cause::SeveralDepths) << verdict.reason;
    named += !verdict.focused;
  }
  EXPECT_GT(named, 0);
}

TEST(DefocusMethod, FocusesInFiveFramesWithALessSharpOneOnEachSide) {
  for (const double start : {-40.0, -15.0, 5.0, 35.0}) {
    const Ending run = RunOn(NaturalWaves(21), start, 3.0, 0.005);
    EXPECT_TRUE(run.verdict.focused) << run.verdict.reason;
    EXPECT_NEAR(run.verdict.position, 3.0, 1.5);
    EXPECT_GT(run.verdict.confidence, 0.95);
    EXPECT_LE(run.frames, 6);
    EXPECT_TRUE(SeenOnBothSides(run)) << start;
  }
}

TEST(DefocusMethod, TakesALooseFrameBeyondTheFocusWhereTheBacklashIsKnown) {
  Defocus method({.lowest = -60.0, .highest = 60.0, .resolution = 0.02, .blur_px = 1.0, .backlash = 3.0});
  const auto waves = NaturalWaves(21);
  std::vector<GoAndLook> asked;
  double position = 50.0;
  while (asked.size() < 6) {
    const auto frame = Picture(waves, position - 3.0, 0.005, static_cast<unsigned>(asked.size()));
    const Advice advice = method.Next({.position = position, .frame = &frame, .window = {0, 0, 192, 192}, .score = {}});
    if (const auto* verdict = std::get_if<Verdict>(&advice)) {
      EXPECT_TRUE(verdict->focused) << verdict->reason;
      EXPECT_NEAR(verdict->position, 3.0, 1.5);
      EXPECT_EQ(verdict->position, asked.back().position);
      break;
    }
    asked.push_back(std::get<GoAndLook>(advice));
    position = asked.back().position;
  }
  ASSERT_GE(asked.size(), 2u);
  EXPECT_TRUE(asked[0].backlash_open);
  EXPECT_LT(asked[0].position, 3.0);
  for (std::size_t i = 1; i < asked.size(); ++i) EXPECT_FALSE(asked[i].backlash_open) << i;
}

TEST(DefocusMethod, APictureThatChangesWhileTheLensStandsIsNoAnswer) {
  // From the second frame on the mechanism is elsewhere than it says, and then it comes to rest.
  const auto waves = NaturalWaves(22);
  const auto picture = [&](double position, int n) {
    const double rings = n == 1 ? 0.0 : n <= 3 ? 3.0 : 0.5;
    return Picture(waves, position + rings - 3.0, 0.005, static_cast<unsigned>(n));
  };
  const Ending run = RunOn(picture, -17.0);
  EXPECT_FALSE(run.verdict.focused && std::abs(run.verdict.position - 3.0) > 2.0) << run.verdict.position;
}

// The same over the whole range of what such a lens may do: at the end it never stands a depth of field off and says
// that it is in focus.
TEST(DefocusMethod, WhatMovesWhileTheLensStandsNeverEndsOutOfFocus) {
  const long trials = lensd::testing::ByLevel(10, 30, 1000);
  std::mt19937 random(71);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  long wrong = 0, focused = 0;
  for (long i = 0; i < trials; ++i) {
    const auto waves = NaturalWaves(static_cast<unsigned>(300 + i), 2.4, 250);
    const double first = -6.0 + 12.0 * uniform(random), later = -3.0 + 6.0 * uniform(random);
    const int until = 2 + static_cast<int>(3.0 * uniform(random));
    double blur = 0.0;
    const auto picture = [&](double position, int n) {
      blur = position - 3.0 + (n < 2 ? 0.0 : n <= until ? first : later);
      return Picture(waves, blur, 0.005, static_cast<unsigned>(n));
    };
    const Ending run = RunSession("auto", picture, -40.0 + 80.0 * uniform(random));
    focused += run.verdict.focused;
    wrong += run.verdict.focused && std::abs(blur) > 4.0;
  }
  EXPECT_EQ(wrong, 0) << "of " << trials;
  EXPECT_GE(focused, trials / 10);
}

TEST(AutoOrder, FollowsWhatTheFirstFramePromises) {
  const auto first = [](const std::vector<Wave>& waves, double range) {
    auto session = Session::Create(
        "auto", {.lowest = -range, .highest = range, .resolution = 0.02, .blur_px = 1.0, .ascending = true});
    EXPECT_TRUE(session);
    EXPECT_TRUE(session->Next(0.0, Picture(waves, 2.0, 0.005, 1), {0.0, 0.0, 1.0, 1.0}));
    return std::string(session->method());
  };
  EXPECT_EQ(first(NaturalWaves(20), 60.0), "defocus");
  EXPECT_EQ(first(NaturalWaves(20), 3.5), "defocus");
  // Nothing to see: a short sweep costs less than hoping, a long one more.
  EXPECT_EQ(first({}, 3.5), "sweep");
  EXPECT_EQ(first({}, 60.0), "defocus");
}

TEST(DefocusMethod, RefusesABlankWall) {
  const Ending run = RunOn({}, 10.0, 0.0, 0.01);
  EXPECT_FALSE(run.verdict.focused);
  EXPECT_NE(run.verdict.reason.find("too little texture"), std::string::npos);
  EXPECT_EQ(run.verdict.cause, Cause::NoTexture);
  EXPECT_LE(run.frames, 4);
}

TEST(DefocusMethod, RefusesAGradient) {
  EXPECT_FALSE(RunOn({{0.0008, 0.0, -0.5 * std::numbers::pi, 0.6}}, 10.0, 0.0, 0.01).verdict.focused);
}

TEST(DefocusMethod, RefusesASinusoidOrFindsIt) {
  // One frequency tells its own contrast alone: where disks of several sizes leave the same, nothing decides.
  for (const double start : {-30.0, 12.0, 25.0}) {
    const Ending run = RunOn({{0.125, 0.0, 0.3, 0.5}}, start, 0.0, 0.01);
    if (run.verdict.focused) {
      EXPECT_NEAR(run.verdict.position, 0.0, 2.0) << start;
    } else {
      EXPECT_NE(run.verdict.reason.find("periodic"), std::string::npos) << run.verdict.reason;
    }
  }
}

TEST(DefocusMethod, RefusesASubjectBeyondTheRange) {
  EXPECT_FALSE(RunOn(NaturalWaves(23), -20.0, 30.0, 0.005, 20.0).verdict.focused);
}

// Lights that clip are left out with their surroundings; what is left still has a focus.
TEST(DefocusMethod, FocusesBesideAClippedLight) {
  const auto waves = NaturalWaves(27);
  const auto picture = [&](double position, int n) {
    auto frame = Picture(waves, position - 3.0, 0.005, static_cast<unsigned>(n));
    auto samples = *frame.samples;
    const double radius = 14.0 + 0.5 * std::abs(position - 3.0);
    for (int y = 0; y < frame.height; ++y) {
      for (int x = 0; x < frame.width; ++x) {
        if (std::hypot(x - 60.0, y - 70.0) < radius) samples[static_cast<std::size_t>(y * frame.width + x)] = 4095;
      }
    }
    frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
    return frame;
  };
  for (const double start : {-25.0, 20.0}) {
    const Ending run = RunSession("auto", picture, start);
    EXPECT_TRUE(run.verdict.focused) << run.verdict.reason;
    EXPECT_NEAR(run.verdict.position, 3.0, 2.0) << start;
  }
}

// A slope told wrong by a factor of two is a worse guide, and no worse an answer.
TEST(DefocusMethod, ASlopeToldWrongGivesNoWrongAnswer) {
  const auto waves = NaturalWaves(28);
  for (const double slope : {0.5, 0.7, 1.5, 2.0}) {
    const auto picture = [&](double position, int n) {
      return Picture(waves, slope * (position - 3.0), 0.005, static_cast<unsigned>(n));
    };
    for (const double start : {-25.0, 20.0}) {
      const Ending run = RunSession("auto", picture, start);
      if (run.verdict.focused) {
        EXPECT_NEAR(slope * run.verdict.position, slope * 3.0, 2.0) << slope;
      }
    }
  }
}

TEST(SessionTest, TheSameFrameSentTwiceIsNamed) {
  const drivers::Frame frame = Picture(NaturalWaves(29), 20.0, 0.005, 1);
  const Ending run = RunSession("auto", [&](double, int) { return frame; }, -20.0);
  EXPECT_FALSE(run.verdict.focused);
  EXPECT_NE(run.verdict.reason.find("the same frame"), std::string::npos) << run.verdict.reason;
  EXPECT_EQ(run.verdict.cause, Cause::SameFrame);
}

TEST(DefocusMethod, RefusesLightsTooBrightForTheSensor) {
  auto waves = NaturalWaves(24);
  for (Wave& wave : waves) wave.amplitude *= 40.0;  // nearly half of it at full scale
  const Ending run = RunOn(waves, -20.0, 0.0, 0.005);
  EXPECT_FALSE(run.verdict.focused);
  EXPECT_NE(run.verdict.reason.find("too bright"), std::string::npos) << run.verdict.reason;
  EXPECT_EQ(run.verdict.cause, Cause::TooBright);
}

TEST(DefocusMethod, NeedsToKnowTheOptics) {
  Defocus method({.lowest = 0.0, .highest = 100.0, .resolution = 1.0, .blur_px = std::nullopt, .ascending = true});
  const auto frame = Picture(NaturalWaves(25), 0.0, 0.01, 1);
  const Advice advice = method.Next({.position = 5.0, .frame = &frame, .window = {0, 0, 192, 192}, .score = {}});
  EXPECT_FALSE(std::get<Verdict>(advice).focused);
}

}  // namespace
}  // namespace lensd::autofocus
