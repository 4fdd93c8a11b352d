// Autofocus on recorded stacks of real lenses, which know nothing of the simulator: no answer is false, whatever the
// optics that were told.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "bench/autofocus/replay.h"

namespace lensd::bench {
namespace {

std::vector<Stack> Stacks() {
  auto stacks = LoadStacks(std::string(LENSD_SOURCE_DIR) + "/tests/bench/stacks", 2.2);
  EXPECT_TRUE(stacks) << stacks.error().message;
  return *std::move(stacks);
}

/// The same in so much more light, cut off at full scale. Where it is in focus does not change.
Stack InMoreLight(Stack stack, double times) {
  for (drivers::Frame& frame : stack.frames) {
    std::vector<std::uint16_t> samples;
    for (const std::uint16_t sample : *frame.samples) {
      const double light = times * std::pow(sample / 255.0, frame.gamma);
      samples.push_back(
          static_cast<std::uint16_t>(std::lround(255.0 * std::pow(std::min(light, 1.0), 1 / frame.gamma))));
    }
    frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
  }
  return stack;
}

/// Dust that darkens, with soft edges, and pixels that glow: the same in every frame.
Stack WithDirt(Stack stack, int specks, int hot, unsigned seed) {
  std::mt19937 random(seed);
  const auto draw = [&](double low, double high) { return low + (high - low) * random() / 4294967295.0; };
  const int width = stack.frames.front().width, height = stack.frames.front().height;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<double> shade(pixels, 1.0), glow(pixels, 0.0);
  for (int i = 0; i < specks; ++i) {
    const double x = draw(0, width), y = draw(0, height), radius = draw(1.5, 8), depth = draw(0.15, 0.6);
    for (std::size_t p = 0; p < pixels; ++p) {
      const std::size_t column = p % static_cast<std::size_t>(width), row = p / static_cast<std::size_t>(width);
      const double off = std::hypot(static_cast<double>(column) - x, static_cast<double>(row) - y);
      if (off < radius + 8) shade[p] *= 1.0 - depth / (1.0 + std::exp(off - radius));
    }
  }
  for (int i = 0; i < hot; ++i) glow[random() % pixels] = draw(0.1, 0.6);
  for (drivers::Frame& frame : stack.frames) {
    std::vector<std::uint16_t> samples;
    for (std::size_t p = 0; p < pixels; ++p) {
      const double light = std::pow((*frame.samples)[p] / 255.0, frame.gamma) * shade[p] + glow[p];
      const double shown = std::pow(std::min(light, 1.0), 1 / frame.gamma);
      samples.push_back(static_cast<std::uint16_t>(std::lround(255.0 * shown)));
    }
    frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
  }
  return stack;
}

struct Counts {
  int runs = 0, within = 0, refused = 0, wrong = 0, inside95 = 0;
  std::vector<int> frames;
};

Counts CountOf(const std::vector<Stack>& stacks, std::string_view kind, const ReplayOptions& options) {
  auto runs = Replay(stacks, options);
  EXPECT_TRUE(runs) << runs.error().message;
  Counts counts;
  for (const ReplayRun& run : *runs) {
    if (run.region.kind != kind) continue;
    ++counts.runs;
    counts.within += run.how == ReplayEnd::Within;
    counts.refused += run.how == ReplayEnd::Refused;
    counts.wrong += run.how == ReplayEnd::False;
    counts.inside95 += run.how != ReplayEnd::Refused && std::abs(run.end - run.region.best) <= 1.96 * run.sigma;
    counts.frames.push_back(run.frames);
  }
  std::ranges::sort(counts.frames);
  std::printf("%.*s: %d runs, %d within, %d refused, %d false, %d frames\n", static_cast<int>(kind.size()), kind.data(),
              counts.runs, counts.within, counts.refused, counts.wrong, counts.frames[counts.frames.size() / 2]);
  return counts;
}

TEST(RecordedStacks, OneDepthIsInFocusInFiveFrames) {
  const Counts counts = CountOf(Stacks(), "one depth", {.starts = 2});
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.within, 48) << "of " << counts.runs;
  EXPECT_LE(counts.frames[counts.frames.size() / 2], 5);
}

TEST(RecordedStacks, WhatOtherRegionsTaughtOfTheSlopeDoesNoHarm) {
  const Counts counts = CountOf(Stacks(), "one depth", {.starts = 6, .learn = true});
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_EQ(counts.within, counts.runs);
  EXPECT_LE(counts.frames[counts.frames.size() / 2], 5);
  EXPECT_GE(counts.inside95, 0.88 * counts.within) << "of the answers in their 95 %";
}

TEST(RecordedStacks, LightsThatClipAreLeftOut) {
  std::vector<Stack> stacks;
  for (const Stack& stack : Stacks()) {
    if (stack.name == "pins") stacks.push_back(InMoreLight(stack, 1.45));
  }
  const Counts counts = CountOf(stacks, "one depth", {.starts = 2});
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.within, 24) << "of " << counts.runs;
}

TEST(RecordedStacks, DirtAndHotPixelsThatStayInPlaceMisleadNobody) {
  std::vector<Stack> stacks, all = Stacks();
  for (Stack& stack : all) {
    if (stack.name != "keyboard") stacks.push_back(WithDirt(std::move(stack), 300, 1500, 77));
  }
  const Counts counts = CountOf(stacks, "one depth", {.starts = 1});
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GE(counts.within, counts.runs - 2);
}

TEST(RecordedStacks, FocusOutsideTheTravelIsRefusedByEveryMethodOfAuto) {
  for (const char* method : {"auto", "defocus", "sweep"}) {
    const Counts counts = CountOf(Stacks(), "outside", {.method = method, .starts = 2});
    EXPECT_EQ(counts.refused, counts.runs) << method;
  }
}

TEST(RecordedStacks, ASlopeToldWrongMakesNoAnswerFalse) {
  for (const double slope : {0.5, 2.0}) {
    const Counts counts = CountOf(Stacks(), "one depth", {.starts = 1, .slope_error = slope});
    EXPECT_EQ(counts.wrong, 0) << slope;
  }
}

}  // namespace
}  // namespace lensd::bench
