// Every bound of the ladder against the rung above and against the highest, in 50-digit arithmetic, over random scenes.
#include "optics/model_ladder.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "exact.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

using Wide = boost::multiprecision::cpp_bin_float_50;
using testing::Draw;

/// One point of the ranges: what may truly be set and seen.
struct Point {
  double n, e, u, shift;
};

/// Blur as each rung predicts it, from the textbook formulas.
Wide BlurOf(Rung rung, const LadderRanges& r, const Point& p) {
  const Wide f = r.focal_length.value;
  const Wide n = p.n;
  const Wide u = p.u;
  const Wide pupil = rung == Rung::Calibrated ? r.pupil_factor : 1.0;
  const Wide e = rung == Rung::Calibrated ? Wide(p.e) + Wide(p.shift) : Wide(p.e);
  if (rung == Rung::Pinhole) return 0;
  const Wide thin = f / n * ((f + e) * (1 / f - u) - 1) / (1 + f * u * (1 / pupil - 1));
  if (rung == Rung::Thin || !r.wavelength) return abs(thin);
  const Wide factor = r.convention == DiffractionConvention::Airy ? Wide(2.44) : Wide(1.75);
  const Wide disk = factor * r.wavelength->value * n * (1 + e / f / pupil);
  return sqrt(thin * thin + disk * disk);
}

LadderRanges DrawRanges(Draw& draw) {
  LadderRanges r;
  const double f = draw.FocalLength();
  r.focal_length = Metres{f};
  r.f_number_low = FNumber{draw.Log(0.7, 16)};
  r.f_number_high = r.f_number_low * draw.Log(1.0, 20);
  r.extension_low = Metres{draw.Coin() ? 0.0 : f * draw.Uniform(-0.1, 0.3)};
  r.extension_high = r.extension_low + Metres{f * draw.Log(1e-8, 1.5)};
  r.far = Dioptres{draw.Coin() ? 0.0 : draw.Log(1e-6, 0.5) / f};
  r.near = r.far + Dioptres{draw.Log(1e-9, 1.0) / f};
  if (draw.Uniform(0, 1) < 0.8) r.wavelength = Metres{draw.Uniform(0.4e-6, 1.1e-6)};
  if (draw.Coin()) r.convention = DiffractionConvention::Mtf50;
  if (draw.Coin()) r.pupil_factor = draw.Uniform(0.4, 1.6);
  if (draw.Coin()) r.calibration_error = Metres{draw.Log(1e-8, 1e-3)};
  return r;
}

double Between(Draw& draw, double low, double high) {
  const double where = draw.Uniform(-0.5, 1.5);
  return where <= 0.0 ? low : where >= 1.0 ? high : std::clamp(low + where * (high - low), low, high);
}

Point DrawPoint(Draw& draw, const LadderRanges& r) {
  return {Between(draw, r.f_number_low.value, r.f_number_high.value),
          Between(draw, r.extension_low.value, r.extension_high.value), Between(draw, r.far.value, r.near.value),
          Between(draw, -r.calibration_error.value, r.calibration_error.value)};
}

TEST(ModelLadderTest, NoBoundIsExceededOverRandomScenes) {
  Draw draw(41);
  for (long i = 0; i < lensd::testing::ByLevel(5000, 100000, 1000000); ++i) {
    const LadderRanges r = DrawRanges(draw);
    const Point p = DrawPoint(draw, r);
    for (const Rung rung : {Rung::Pinhole, Rung::Thin, Rung::Diffraction}) {
      const Rung above = static_cast<Rung>(static_cast<int>(rung) + 1);
      const Wide bound = LeftOut(rung, r).value;
      ASSERT_LE(abs(BlurOf(rung, r, p) - BlurOf(Rung::Calibrated, r, p)), bound) << i << ' ' << RungName(rung);
      // Towards the next rung alone: what the rungs above it add again is not needed.
      const Wide step = bound - Wide(LeftOut(above, r).value) * (1 - Wide(1e-13));
      if (rung != Rung::Pinhole) {
        ASSERT_LE(abs(BlurOf(rung, r, p) - BlurOf(above, r, p)), step) << i << ' ' << RungName(rung);
      } else {
        ASSERT_LE(BlurOf(Rung::Diffraction, r, p), bound) << i;
      }
    }
  }
}

// A bound far above every error would send every plan up the ladder.
TEST(ModelLadderTest, BoundsAreReached) {
  LadderRanges r{.focal_length = Metres{0.05},
                 .f_number_low = FNumber{2},
                 .f_number_high = FNumber{8},
                 .extension_low = Metres{0},
                 .extension_high = Metres{0.004},
                 .far = Dioptres{0},
                 .near = Dioptres{1}};
  EXPECT_NEAR(LeftOut(Rung::Pinhole, r).value, 0.05 / 2 * (0.004 / 0.05), 1e-15);
  EXPECT_EQ(LeftOut(Rung::Thin, r).value, 0.0);
  r.wavelength = Metres{550e-9};
  EXPECT_NEAR(LeftOut(Rung::Thin, r).value, 2.44 * 550e-9 * 8 * 1.08, 1e-18);
  EXPECT_EQ(LeftOut(Rung::Diffraction, r).value, 0.0);
  r.extension_low = Metres{0.0039};
  r.near = Dioptres{0.1};
  const double least = 0.05 / 8 * (0.0039 / 0.05 - 0.0539 * 0.1);
  const double disk = 2.44 * 550e-9 * 8 * 1.08;
  EXPECT_NEAR(LeftOut(Rung::Thin, r).value, std::hypot(least, disk) - least, 1e-15);
  r.calibration_error = Metres{8e-6};
  EXPECT_NEAR(LeftOut(Rung::Diffraction, r).value, 4e-6, 0.1e-6);
}

TEST(ModelLadderTest, ClimbsOnlyWhileTheBoundExceedsTheTolerance) {
  const LadderRanges hyperfocal{.focal_length = Metres{0.004},
                                .f_number_low = FNumber{8},
                                .f_number_high = FNumber{8},
                                .extension_low = Metres{0},
                                .extension_high = Metres{0},
                                .far = Dioptres{0},
                                .near = Dioptres{0.2},
                                .wavelength = Metres{550e-9},
                                .pupil_factor = 0.9};
  EXPECT_EQ(SimplestModel(hyperfocal, Metres{20e-6}).rung, Rung::Pinhole);
  EXPECT_EQ(SimplestModel(hyperfocal, Metres{10.74e-6}).rung, Rung::Thin);
  EXPECT_EQ(SimplestModel(hyperfocal, Metres{1e-6}).rung, Rung::Diffraction);
  EXPECT_LE(SimplestModel(hyperfocal, Metres{1e-6}).error.value, 1e-6);
  EXPECT_EQ(SimplestModel(hyperfocal, Metres{0}).rung, Rung::Calibrated);
  EXPECT_EQ(RungName(Rung::Calibrated), "calibrated");
}

TEST(ModelLadderTest, NothingDescribedMeansNothingLeftOut) {
  const LadderRanges plain{.focal_length = Metres{0.05},
                           .f_number_low = FNumber{1.4},
                           .f_number_high = FNumber{22},
                           .extension_low = Metres{0},
                           .extension_high = Metres{0.008},
                           .far = Dioptres{0},
                           .near = Dioptres{2}};
  EXPECT_EQ(SimplestModel(plain, Metres{0}).rung, Rung::Thin);
  EXPECT_EQ(SimplestModel(plain, Metres{0}).error.value, 0.0);
}

TEST(ModelLadderTest, DefaultToleranceIsATenthOfALimitOrAQuarterPixel) {
  EXPECT_DOUBLE_EQ(DefaultModelTolerance(Metres{20e-6}, std::nullopt).value, 2e-6);
  EXPECT_DOUBLE_EQ(DefaultModelTolerance(Metres{20e-6}, Metres{12e-6}).value, 3e-6);
  EXPECT_DOUBLE_EQ(DefaultModelTolerance(std::nullopt, Metres{12e-6}).value, 3e-6);
  EXPECT_EQ(DefaultModelTolerance(std::nullopt, std::nullopt).value, 0.0);
}

}  // namespace
}  // namespace lensd::optics
