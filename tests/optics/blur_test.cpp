// The blur formula against exact arithmetic over all legal lenses, and its limits: infinity, macro, no power.
#include "optics/blur.h"

#include <gtest/gtest.h>

#include "exact.h"
#include "optics/conjugates.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

using testing::Draw;
using testing::Exact;
using testing::RelativeError;

struct Case {
  double f, n, e;
};

/// A lens focused anywhere legal: past infinity, at it, far, near, macro.
Case DrawLens(Draw& draw) {
  const double f = draw.FocalLength();
  const double kind = draw.Uniform(0, 4);
  if (kind < 1) return {f, draw.FNumber(), -f * draw.Log(1e-9, 0.5)};
  if (kind < 1.2) return {f, draw.FNumber(), 0.0};
  return {f, draw.FNumber(), Extension(Metres{f}, Metres{draw.Beyond(f)}).value};
}

TEST(BlurTest, AgreesWithExactArithmeticEverywhere) {
  Draw draw(11);
  for (long i = 0; i < lensd::testing::ByLevel(2000, 10000, 1000000); ++i) {
    const auto [f, n, e] = DrawLens(draw);
    const ThinLens lens{Metres{f}, FNumber{n}, Metres{e}};
    const double z = draw.Coin() ? draw.Beyond(f) : f * draw.Log(1e-3, 1.0);
    const double u = 1.0 / z;
    const Exact from_distance = testing::SignedBlur(Exact(f), Exact(n), Exact(e), 1 / Exact(z));
    const Exact from_vergence = testing::SignedBlur(Exact(f), Exact(n), Exact(e), Exact(u));
    const Exact at_infinity = testing::SignedBlur(Exact(f), Exact(n), Exact(e), 0);
    ASSERT_LE(RelativeError(SignedBlur(lens, Metres{z}).value, from_distance), 1e-12) << f << ' ' << e << ' ' << z;
    ASSERT_LE(RelativeError(SignedBlur(lens, Dioptres{u}).value, from_vergence), 1e-12) << f << ' ' << e << ' ' << u;
    ASSERT_LE(RelativeError(SignedBlur(lens, Metres{INFINITY}).value, at_infinity), 1e-12);
    ASSERT_LE(RelativeError(SignedBlur(lens, Dioptres{0}).value, at_infinity), 1e-12);
    ASSERT_EQ(Blur(lens, Metres{z}).value, std::abs(SignedBlur(lens, Metres{z}).value));
  }
}

// Where focus and subject nearly coincide, the formula as printed in textbooks has no digit left.
TEST(BlurTest, KeepsItsDigitsNextToThePlaneInFocus) {
  Draw draw(12);
  for (long i = 0; i < lensd::testing::ByLevel(2000, 10000, 1000000); ++i) {
    const double f = draw.FocalLength();
    const double n = draw.FNumber();
    const double z = draw.Beyond(f);
    const double e = Extension(Metres{f}, Metres{z * (1.0 + draw.Uniform(-1, 1) * draw.Log(1e-15, 1e-3))}).value;
    const ThinLens lens{Metres{f}, FNumber{n}, Metres{e}};
    ASSERT_LE(RelativeError(SignedBlur(lens, Metres{z}).value,
                            testing::SignedBlur(Exact(f), Exact(n), Exact(e), 1 / Exact(z))),
              1e-12);
    ASSERT_LE(RelativeError(SignedBlur(lens, Dioptres{1 / z}).value,
                            testing::SignedBlur(Exact(f), Exact(n), Exact(e), Exact(1 / z))),
              1e-12);
  }
}

TEST(BlurTest, SignIsPositiveBehindTheFocalPlaneAndLinearInVergence) {
  const ThinLens lens{Metres{0.05}, FNumber{2}, Extension(Metres{0.05}, Dioptres{1.0})};
  EXPECT_GT(SignedBlur(lens, Metres{2.0}).value, 0.0);
  EXPECT_LT(SignedBlur(lens, Metres{0.5}).value, 0.0);
  const double at0 = SignedBlur(lens, Dioptres{0}).value;
  const double at1 = SignedBlur(lens, Dioptres{10}).value;
  EXPECT_NEAR(SignedBlur(lens, Dioptres{5}).value, (at0 + at1) / 2, 1e-17);
}

TEST(BlurTest, PastInfinityEverySubjectIsInFront) {
  const ThinLens lens{Metres{0.05}, FNumber{2}, Metres{-1e-4}};
  for (const double z : {0.02, 0.05, 1.0, 1e9, double(INFINITY)}) EXPECT_LT(SignedBlur(lens, Metres{z}).value, 0.0);
}

TEST(BlurTest, MacroBeyondLifeSize) {
  const ThinLens lens{Metres{0.05}, FNumber{4}, Metres{0.1}};  // m = 2, in focus at 75 mm
  EXPECT_NEAR(SignedBlur(lens, Metres{0.075}).value, 0.0, 1e-17);
  EXPECT_LE(RelativeError(SignedBlur(lens, Metres{0.076}).value,
                          testing::SignedBlur(Exact(0.05), 4, Exact(0.1), 1 / Exact(0.076))),
            1e-12);
}

// A lens without power is a hole: with A and Z_s held, the thin lens tends to the bare aperture in proportion to 1/f.
TEST(BlurTest, ALensWithoutPowerIsABareAperture) {
  const double a = 0.01, d = 0.06;
  for (const double f : {64.0, 1024.0, 65536.0}) {
    const ThinLens lens{Metres{f}, FNumber{f / a}, Metres{d - f}};
    for (const double z : {0.03, 0.5, 4.0, 1e6}) {
      const double hole = thin_lens::SignedBlurOfHole<double>(a, d, {z, 1.0});
      EXPECT_NEAR(SignedBlur(lens, Metres{z}).value, hole, a * d / f + 1e-11);
    }
  }
}

TEST(BlurTest, PupilDivisorIsOneForSymmetricLensesAndAtInfinity) {
  EXPECT_EQ(PupilDivisor(Metres{0.05}, Metres{0.2}, 1.0), 1.0);
  EXPECT_EQ(PupilDivisor(Metres{0.05}, Metres{INFINITY}, 0.5), 1.0);
  EXPECT_DOUBLE_EQ(PupilDivisor(Metres{0.05}, Dioptres{10.0}, 0.5), 1.5);
}

}  // namespace
}  // namespace lensd::optics
