// What is learned of a lens' blur: what it holds under, and what becomes of it once other optics are told. The truth is
// the blur a step makes, by the f-number that the lens really has.
#include "rig/learned_slope.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "io/toml.h"

namespace lensd::rig {
namespace {

using Learned = autofocus::SlopeLearner::Learned;

constexpr double kSteps = 1000.0, kPixelUm = 4.0, kTrueFNumber = 2.0, kTravelM = 1e-3;
constexpr double kTruePx = kTravelM / kSteps / (kTrueFNumber * kPixelUm * 1e-6);  // a step

drivers::Capabilities Motors(bool iris) {
  drivers::Capabilities can;
  can.axes[drivers::Axis::Focus].emplace();
  can.axes[drivers::Axis::Focus]->maximum = Native{kSteps};
  can.axes[drivers::Axis::Focus]->direction = {drivers::Direction::NearPositive, "the test"};
  if (iris) {
    can.axes[drivers::Axis::Iris].emplace();
    can.axes[drivers::Axis::Iris]->maximum = Native{100.0};
  }
  return can;
}

OpticsTable Told(double widest, double smallest, double travel_m = kTravelM) {
  const drivers::NominalOptics optics{
      .focal_length_m = 0.025, .min_f_number = widest, .max_f_number = smallest, .max_extension_m = travel_m};
  return *OpticsTable::Create(optics, Motors(widest < smallest), RigConfig{}, nullptr);
}

/// A run on a lens with kTruePx, of which `optics` tell otherwise.
SlopeRun RunOn(const OpticsTable& optics, SlopeConditions under = {.iris = {}, .zoom = {}, .pixel_um = kPixelUm}) {
  SlopeRun run{.under = under, .position = Native{400.0}};
  run.told_px = *ToldSlope(optics, under, run.position);
  run.log_factor = std::log(kTruePx / run.told_px);
  return run;
}

TEST(LearnedSlope, WhatIsToldIsThePixelsOfBlurAStep) {
  EXPECT_NEAR(*ToldSlope(Told(2.0, 2.0), {.pixel_um = kPixelUm}, Native{400.0}), kTruePx, 1e-9 * kTruePx);
  EXPECT_FALSE(ToldSlope(Told(2.0, 2.0), {}, Native{400.0}));
  EXPECT_FALSE(ToldSlope(Told(2.0, 16.0), {.pixel_um = kPixelUm}, Native{400.0}));  // where is the iris?
}

TEST(LearnedSlope, IsOfTheLensAndNotOfWhatWasTold) {
  const OpticsTable wrong = Told(4.0, 4.0);
  LearnedSlope learned;
  for (int i = 0; i < 3; ++i) learned.Add(RunOn(wrong), wrong);
  const SlopeConditions under{.pixel_um = kPixelUm};
  ASSERT_TRUE(learned.Known(under, wrong));
  EXPECT_NEAR(learned.Known(under, wrong)->log_factor, std::log(2.0), 1e-9);
  // The configuration is mended: nothing is left to correct. Or the travel turns out otherwise.
  EXPECT_NEAR(learned.Known(under, Told(2.0, 2.0))->log_factor, 0.0, 1e-9);
  EXPECT_NEAR(learned.Known(under, Told(2.0, 2.0, 0.5 * kTravelM))->log_factor, std::log(2.0), 1e-9);
  // And a run by the mended one is of the same lens.
  EXPECT_EQ(learned.Add(RunOn(Told(2.0, 2.0)), Told(2.0, 2.0)), Learned::Added);
  EXPECT_EQ(learned.runs().size(), 4U);
}

TEST(LearnedSlope, HoldsForTheOpeningAndTheCameraAlone) {
  const OpticsTable optics = Told(2.0, 16.0);
  const auto at = [&](double f_number) {
    return SlopeConditions{.iris = optics.NativeFromFNumber(FNumber{f_number}), .zoom = {}, .pixel_um = kPixelUm};
  };
  LearnedSlope learned;
  for (int i = 0; i < 3; ++i) learned.Add(RunOn(optics, at(2.8)), optics);
  EXPECT_TRUE(learned.Known(at(2.8), optics));
  EXPECT_TRUE(learned.Known(at(2.9), optics));
  EXPECT_FALSE(learned.Known(at(4.0), optics));
  SlopeConditions other = at(2.8);
  other.pixel_um = 3.0;
  EXPECT_FALSE(learned.Known(other, optics));
  other = at(2.8);
  other.frames = SlopeConditions::Frames::Outside;
  EXPECT_FALSE(learned.Known(other, optics));
  other = at(2.8);
  other.iris.reset();
  EXPECT_FALSE(learned.Known(other, optics));
  other = at(2.8);
  other.pixel_um = 0.0;
  EXPECT_FALSE(learned.Known(other, optics));
  // Another opening is learned beside it.
  EXPECT_EQ(learned.Add(RunOn(optics, at(4.0)), optics), Learned::Added);
  EXPECT_TRUE(learned.Known(at(2.8), optics));
}

TEST(LearnedSlope, AnotherLensEndsAllOfIt) {
  const OpticsTable optics = Told(2.0, 16.0);
  const auto at = [&](double f_number) {
    return SlopeConditions{.iris = optics.NativeFromFNumber(FNumber{f_number}), .zoom = {}, .pixel_um = kPixelUm};
  };
  LearnedSlope learned;
  for (const double f_number : {2.8, 4.0}) {
    for (int i = 0; i < 3; ++i) learned.Add(RunOn(optics, at(f_number)), optics);
  }
  SlopeRun other = RunOn(optics, at(4.0));
  other.log_factor += std::log(1.5);
  EXPECT_EQ(learned.Add(other, optics), Learned::AnotherLens);
  EXPECT_EQ(learned.runs().size(), 1U);
  EXPECT_FALSE(learned.Known(at(2.8), optics));
}

/// Of the runs that hold: where the newest of them focused, as an extension, and how much alike both sides are.
TEST(LearnedSlope, TellsWhereTheNewestRunEndedAndHowMuchAlikeBothSidesAre) {
  const OpticsTable optics = Told(2.0, 16.0);
  const auto at = [&](double f_number) {
    return SlopeConditions{.iris = optics.NativeFromFNumber(FNumber{f_number}), .zoom = {}, .pixel_um = kPixelUm};
  };
  LearnedSlope learned;
  for (const double position : {200.0, 300.0, 600.0}) {
    SlopeRun run = RunOn(optics, at(2.8));
    run.position = Native{position};
    run.uneven = 0.1;
    learned.Add(run, optics);
  }
  SlopeRun stopped_down = RunOn(optics, at(8.0));
  stopped_down.position = Native{900.0};
  learned.Add(stopped_down, optics);
  const auto known = learned.Known(at(2.8), optics);
  ASSERT_TRUE(known && known->uneven && known->last_focus);
  EXPECT_NEAR(*known->uneven, 0.1, 1e-9);
  EXPECT_NEAR(*known->last_focus, optics.ExtensionFromNative(Native{600.0}).value, 1e-12);
}

TEST(LearnedSlope, KeepsTheNewest) {
  const OpticsTable optics = Told(2.0, 2.0);
  LearnedSlope learned;
  for (int i = 0; i < 300; ++i) learned.Add(RunOn(optics), optics);
  EXPECT_EQ(learned.runs().size(), SlopeRun::kMost);
}

TEST(LearnedSlope, ItsFileReadsBack) {
  const OpticsTable optics = Told(2.0, 16.0);
  std::vector<SlopeRun> runs;
  SlopeConditions under{.iris = Native{3.0}, .zoom = Native{7.5}, .pixel_um = 3.45};
  under.frames = SlopeConditions::Frames::Outside;
  runs.push_back(RunOn(optics, under));
  runs.back().made = "2026-11-25T22:00:00Z";
  runs.back().uneven = -0.02;
  runs.push_back(RunOn(Told(2.0, 2.0)));
  const auto settings = io::ParseToml(LearnedSlopeText(runs), "cam.slope.toml");
  ASSERT_TRUE(settings);
  const auto read = ReadLearnedSlope(*settings);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*read)[i].under.iris, runs[i].under.iris);
    EXPECT_EQ((*read)[i].under.zoom, runs[i].under.zoom);
    EXPECT_EQ((*read)[i].under.pixel_um, runs[i].under.pixel_um);
    EXPECT_EQ((*read)[i].under.frames, runs[i].under.frames);
    EXPECT_EQ((*read)[i].position, runs[i].position);
    EXPECT_EQ((*read)[i].told_px, runs[i].told_px);
    EXPECT_EQ((*read)[i].log_factor, runs[i].log_factor);
    EXPECT_EQ((*read)[i].uneven, runs[i].uneven);
    EXPECT_EQ((*read)[i].made, runs[i].made);
  }
  EXPECT_EQ(LearnedSlopeText({}), "");
  const auto wrong =
      io::ParseToml("version = 1\n[[run]]\npixel_um = 3\nposition = 1\ntold_px = 1\nlog_factor = 9\n", "f");
  EXPECT_THAT(ReadLearnedSlope(*wrong).error().message, ::testing::HasSubstr("f:6"));
  const auto empty = io::ParseToml("", "f");
  EXPECT_THAT(ReadLearnedSlope(*empty).error().message, ::testing::HasSubstr("version = 1"));
}

}  // namespace
}  // namespace lensd::rig
