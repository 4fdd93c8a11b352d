// Light, diffraction, depth of field and distance scales.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "exact.h"
#include "optics/blur.h"
#include "optics/conjugates.h"
#include "optics/diffraction.h"
#include "optics/focus_scale.h"
#include "optics/light.h"

namespace lensd::optics {
namespace {

using testing::Draw;
using testing::Exact;
using testing::RelativeError;

TEST(LightTest, TheApertureIsTheFocalLengthOverTheFNumber) {
  EXPECT_DOUBLE_EQ(ApertureDiameter(Metres{0.05}, FNumber{2.0}).value, 0.025);
}

TEST(LightTest, WorkingFNumberIsSensorDistanceOverAperture) {
  const Metres f{0.05};
  const Metres e{0.01};
  const FNumber n{2.8};
  const FNumber working = WorkingFNumber(n, Magnification(f, e));
  EXPECT_DOUBLE_EQ(working.value, (f + e) / ApertureDiameter(f, n));
  EXPECT_DOUBLE_EQ(WorkingFNumber(FNumber{4}, 1.0, 0.5).value, 12.0);
}

TEST(LightTest, SubtendedAngleTendsToApertureOverDistance) {
  EXPECT_NEAR(SubtendedAngle(FNumber{0.5}), std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(SubtendedAngle(FNumber{1000.0}) * 1000.0, 1.0, 1e-7);
}

TEST(DiffractionTest, ConventionsAndTheirSum) {
  EXPECT_DOUBLE_EQ(DiffractionBlur(DiffractionConvention::Airy, Metres{550e-9}, FNumber{8}).value, 2.44 * 550e-9 * 8);
  EXPECT_DOUBLE_EQ(DiffractionBlur(DiffractionConvention::Mtf50, Metres{550e-9}, FNumber{8}).value, 1.75 * 550e-9 * 8);
  EXPECT_DOUBLE_EQ(TotalBlur(Metres{3e-6}, Metres{4e-6}).value, 5e-6);
}

TEST(FocusScaleTest, SensorDistancesSolveTheLensEquation) {
  Draw draw(22);
  for (int i = 0; i < 3000; ++i) {
    const double f = draw.FocalLength();
    const FocusScale scale{DistanceFrom::Sensor, Metres{draw.Uniform(0, 0.02)}};
    const double distance = scale.principal_gap.value + 4 * f * (1 + draw.Log(1e-9, 1e9));
    const auto depth = DepthInFocus(scale, Metres{f}, Metres{distance});
    ASSERT_TRUE(depth);
    const Exact z(depth->distance()->value);
    const Exact total = z + 1 / (1 / Exact(f) - 1 / z) + Exact(scale.principal_gap.value);
    ASSERT_LE(RelativeError(distance, total), 1e-14);
    ASSERT_GE(z, 2 * Exact(f) * Exact(1 - 1e-15));
    const Metres e = Extension(Metres{f}, *depth);
    ASSERT_NEAR(DepthAt(scale, Metres{f}, e, Metres{distance})->distance()->value / depth->distance()->value, 1.0,
                1e-13);
  }
}

TEST(FocusScaleTest, TheConfusionCostsWhatItShould) {
  const auto depth = DepthInFocus({DistanceFrom::Sensor}, Metres{0.05}, Metres{0.8});
  EXPECT_NEAR(depth->vergence().value - 1 / 0.8, 0.09, 0.005);
}

TEST(FocusScaleTest, InfinityIsInfinityOnEveryScale) {
  for (const auto from : {DistanceFrom::Lens, DistanceFrom::Sensor, DistanceFrom::Front}) {
    const auto depth = DepthInFocus({from, Metres{0.01}, Metres{0.03}}, Metres{0.05}, Metres{INFINITY});
    ASSERT_TRUE(depth);
    EXPECT_EQ(depth->vergence().value, 0.0);
  }
}

TEST(FocusScaleTest, LifeSizeIsTheShortestDistanceFromTheSensor) {
  EXPECT_DOUBLE_EQ(DepthInFocus({DistanceFrom::Sensor}, Metres{0.05}, Metres{0.2})->distance()->value, 0.1);
  const auto shorter = DepthInFocus({DistanceFrom::Sensor}, Metres{0.05}, Metres{0.199});
  ASSERT_FALSE(shorter);
  EXPECT_EQ(shorter.error().code, Code::OutOfRange);
  EXPECT_THAT(shorter.error().message, ::testing::HasSubstr("200 mm"));
}

TEST(FocusScaleTest, FrontAddsTheLengthOfTheLens) {
  const FocusScale scale{DistanceFrom::Front, Metres{0}, Metres{0.04}};
  EXPECT_DOUBLE_EQ(DepthInFocus(scale, Metres{0.05}, Metres{0.46})->distance()->value, 0.5);
  EXPECT_FALSE(DepthAt({DistanceFrom::Sensor}, Metres{0.05}, Metres{0.0}, Metres{0.04}));
  EXPECT_FALSE(DepthInFocus({DistanceFrom::Lens}, Metres{0.05}, Metres{-1.0}));
}

}  // namespace
}  // namespace lensd::optics
