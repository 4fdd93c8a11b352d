// Slices and verdicts on numbers that are drawn, judged by the words of the promise.
#include "verify/limit_verdict.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace lensd::verify {
namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

TEST(SliceEdges, AreAboutAsThickAsAskedAndNoSliceLiesAcrossAnEndOfALimit) {
  std::mt19937 random(5);
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int draw = 0; draw < 300; ++draw) {
    std::vector<float> depth = {0.0f};  // unknown
    for (int i = 0; i < 20; ++i) depth.push_back(static_cast<float>(between(0.5, 6.0)));
    const auto [nearest, farthest] = std::minmax_element(depth.begin() + 1, depth.end());
    std::vector<BlurLimit> limits;
    for (int i = 0; i < 3; ++i) {
      const double end = between(0.2, 5.0);
      limits.push_back({.near_m = end, .far_m = i == 0 ? kForever : end + between(0.01, 3.0)});
    }
    const double thick = between(0.02, 1.0);
    const auto edges = SliceEdges(depth, limits, thick);
    ASSERT_TRUE(edges.has_value());
    EXPECT_EQ(edges->front(), *nearest);
    EXPECT_GT(edges->back(), *farthest);
    EXPECT_LT(edges->back(), *farthest + 1e-5);
    for (std::size_t i = 1; i < edges->size(); ++i) {
      const double near = (*edges)[i - 1], far = (*edges)[i];
      ASSERT_LT(near, far);
      EXPECT_LE(far - near, 1.5 * thick * (1 + 1e-9));
      for (const BlurLimit& limit : limits) {
        for (const double end : {limit.near_m, limit.far_m}) EXPECT_FALSE(near < end && end < far && far <= *farthest);
      }
    }
  }
}

TEST(SliceEdges, RefusesDepthsThatAreUnknownAndSlicesWithoutAnEnd) {
  EXPECT_EQ(SliceEdges(std::vector<float>(5), {}, 0.1).error().code, Code::BadData);
  const std::vector<float> depth = {1.0f, 60.0f};
  EXPECT_TRUE(SliceEdges(depth, {}, 0.1).has_value());
  for (const double thin : {0.01, 1e-9, 1e-300}) {
    EXPECT_EQ(SliceEdges(depth, {}, thin).error().code, Code::InvalidArgument) << thin;
  }
}

SliceBlur Measured(double near_m, double low_px, double diameter_px, double high_px) {
  return {.near_m = near_m,
          .far_m = near_m + 0.1,
          .mean_m = near_m + 0.05,
          .pixels = 1000,
          .diameter_px = diameter_px,
          .low_px = low_px,
          .high_px = high_px,
          .open = false,
          .gain = 1.0};
}

// Every bar is drawn around the limit; the answer is counted out in words of the header.
TEST(Judge, SaysWhatTheBarsSay) {
  std::mt19937 random(6);
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  int answers[3] = {};
  for (int draw = 0; draw < 2000; ++draw) {
    const bool sharp = draw % 2 == 0;
    const BlurLimit limit{.name = "it",
                          .kind = sharp ? BlurLimit::Kind::Sharp : BlurLimit::Kind::Blurred,
                          .near_m = 2.0,
                          .far_m = sharp ? 3.0 : kForever,
                          .limit_px = 3.0};
    const double bias = between(-1.0, 1.0);
    std::vector<SliceBlur> slices = {Measured(1.0, sharp ? 9.0 : 0.1, 9.0, 9.5), Measured(2.5, 9.0, 9.0, 9.0)};
    slices[1].pixels = kFewestPixels - 1;  // neither counts: one lies before the limit, one is too small
    slices[1].high_px = sharp ? 9.0 : 0.2;
    bool one_beyond = false, all_within = true;
    double worst = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double middle = limit.limit_px + bias + between(-0.3, 0.3), half = between(0.01, 0.3);
      slices.push_back(Measured(2.1 + 0.2 * i, middle - half, middle, middle + half));
      slices.back().open = draw % 20 < 2 && i == 0;  // its upper end is not known
      const bool open = slices.back().open;
      one_beyond |= sharp ? middle - half > 3.0 : !open && middle + half < 3.0;
      all_within &= sharp ? !open && middle + half <= 3.3 : middle - half >= 2.7;
      if (i == 0 || (sharp ? middle > worst : middle < worst)) worst = middle;
    }
    const Verdict verdict = Judge(limit, slices);
    const Answer expected = one_beyond ? Answer::Broken : all_within ? Answer::Holds : Answer::CannotTell;
    ASSERT_EQ(verdict.answer, expected) << "draw " << draw;
    EXPECT_EQ(verdict.pixels, 3000);
    ASSERT_TRUE(verdict.worst.has_value());
    EXPECT_EQ(verdict.worst->diameter_px, worst);
    ++answers[static_cast<int>(verdict.answer)];
  }
  for (const int count : answers) EXPECT_GT(count, 100);
}

TEST(Judge, CannotTellWithoutASlice) {
  const BlurLimit limit{.name = "it", .kind = BlurLimit::Kind::Sharp, .near_m = 4.0, .far_m = 5.0, .limit_px = 1.0};
  const Verdict verdict = Judge(limit, std::vector{Measured(1.0, 0.1, 0.2, 0.3)});
  EXPECT_EQ(verdict.answer, Answer::CannotTell);
  EXPECT_FALSE(verdict.worst.has_value());
  EXPECT_EQ(verdict.pixels, 0);
}

}  // namespace
}  // namespace lensd::verify
