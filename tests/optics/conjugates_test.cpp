#include "optics/conjugates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exact.h"
#include "test_level.h"

namespace lensd::optics {
namespace {

using testing::Draw;
using testing::Exact;
using testing::RelativeError;
using testing::UlpError;

TEST(ConjugatesTest, ExtensionIsWithinFourUlpOfExactFromItsOwnInput) {
  Draw draw(1);
  double worst_distance = 0.0;
  double worst_vergence = 0.0;
  for (long i = 0; i < lensd::testing::ByLevel(3000, 20000, 1000000); ++i) {
    const double f = draw.FocalLength();
    const double z = draw.Beyond(f);
    const double u = 1.0 / z;
    worst_distance = std::max(worst_distance, UlpError(Extension(Metres{f}, Metres{z}).value,
                                                       testing::ExtensionFromDistance(Exact(f), Exact(z))));
    if (Exact(f) * Exact(u) == 1) continue;
    worst_vergence = std::max(worst_vergence, UlpError(Extension(Metres{f}, Dioptres{u}).value,
                                                       testing::ExtensionFromVergence(Exact(f), Exact(u))));
  }
  RecordProperty("distance_ulp", std::to_string(worst_distance));
  RecordProperty("vergence_ulp", std::to_string(worst_vergence));
  EXPECT_LE(worst_distance, 4.0);
  EXPECT_LE(worst_vergence, 4.0);
}

TEST(ConjugatesTest, InfinityNeedsNoExtension) {
  EXPECT_EQ(Extension(Metres{0.05}, Metres{INFINITY}).value, 0.0);
  EXPECT_EQ(Extension(Metres{0.05}, Dioptres{0.0}).value, 0.0);
  EXPECT_NEAR(Extension(Metres{0.05}, Metres{1000.0}).value, 2.5e-6, 2e-10);
}

TEST(ConjugatesTest, ImageDepthAgreesWithTheLensEquationExactly) {
  Draw draw(2);
  for (long i = 0; i < lensd::testing::ByLevel(1000, 5000, 100000); ++i) {
    const double f = draw.FocalLength();
    const double z = draw.Coin() ? draw.Beyond(f) : f * draw.Uniform(0.001, 0.999);
    const Exact truth = 1 / (1 / Exact(f) - 1 / Exact(z));
    ASSERT_LE(RelativeError(ImageDepth(Metres{f}, Metres{z})->value, truth), 1e-12) << f << " " << z;
  }
  EXPECT_EQ(ImageDepth(Metres{0.05}, Metres{0.05}), std::nullopt);
  EXPECT_LT(ImageDepth(Metres{0.05}, Metres{0.03})->value, 0.0);
}

TEST(ConjugatesTest, MatrixIsItsOwnInverseUpToScale) {
  const double f = 0.035;
  const Matrix4 m = ThinLensMatrix(Metres{f});
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 4; ++k) sum += m[row][k] * m[k][column];
      EXPECT_NEAR(sum, row == column ? f * f : 0.0, 1e-18);
    }
  }
}

TEST(ConjugatesTest, ConjugateIsTheMatrixProductAndReturnsWhereItCameFrom) {
  Draw draw(3);
  for (int i = 0; i < 2000; ++i) {
    const double f = draw.FocalLength();
    const HomogeneousPoint p{draw.Uniform(-2, 2), draw.Uniform(-2, 2), draw.Uniform(-3, 3), draw.Uniform(-1, 1)};
    const HomogeneousPoint image = Conjugate(Metres{f}, p);
    const Matrix4 m = ThinLensMatrix(Metres{f});
    for (std::size_t row = 0; row < 4; ++row) {
      Exact truth = 0;
      for (std::size_t k = 0; k < 4; ++k) truth += Exact(m[row][k]) * Exact(p[k]);
      ASSERT_LE(RelativeError(image[row], truth), 1e-12);
    }
    const HomogeneousPoint back = Conjugate(Metres{f}, image);
    for (std::size_t k = 0; k < 4; ++k) ASSERT_NEAR(back[k] / (f * f), p[k], 1e-9 * (1 + std::abs(p[2]) / f));
  }
}

TEST(ConjugatesTest, DirectionsAndTheFrontFocalPlaneNeedNoSpecialCase) {
  const Metres f{0.05};
  EXPECT_EQ(Conjugate(f, {0, 0, 1, 0}), (HomogeneousPoint{0, 0, 0.05, 1}));
  const HomogeneousPoint from_focal_plane = Conjugate(f, {0.01, 0, 0.05, 1});
  EXPECT_EQ(from_focal_plane[3], 0.0);
  EXPECT_EQ(Cartesian(from_focal_plane), std::nullopt);
  const auto slanted = Cartesian(Conjugate(f, {0.1, -0.2, 1, 0}));
  ASSERT_TRUE(slanted);
  EXPECT_DOUBLE_EQ((*slanted)[0].value, 0.005);
  EXPECT_DOUBLE_EQ((*slanted)[1].value, -0.010);
  EXPECT_DOUBLE_EQ((*slanted)[2].value, 0.050);
}

TEST(ConjugatesTest, HalfTrianglesAgreeWithTheMatrix) {
  Draw draw(4);
  for (int i = 0; i < 2000; ++i) {
    const double f = draw.FocalLength();
    const double z = draw.Coin() ? draw.Beyond(f) : f * draw.Uniform(0.01, 0.99);
    const double x = draw.Uniform(-1, 1);
    const Exact truth = Exact(f) * Exact(x) / (Exact(z) - Exact(f));
    const auto height = ImageHeight(Metres{f}, Metres{x}, Metres{z});
    ASSERT_TRUE(height);
    ASSERT_LE(RelativeError(height->value, truth), 1e-12);
    ASSERT_LE(RelativeError((*Cartesian(Conjugate(Metres{f}, {x, 0, z, 1})))[0].value, truth), 1e-12);
    const auto back = ObjectHeight(Metres{f}, *height, Extension(Metres{f}, Metres{z}));
    ASSERT_TRUE(back);
    ASSERT_NEAR(back->value, x, 1e-14);
  }
  EXPECT_EQ(ImageHeight(Metres{0.05}, Metres{1}, Metres{0.05}), std::nullopt);
  EXPECT_EQ(ObjectHeight(Metres{0.05}, Metres{1}, Metres{0}), std::nullopt);
  EXPECT_EQ(ImageHeight(Metres{0.05}, Metres{1}, Metres{INFINITY})->value, 0.0);
}

TEST(ConjugatesTest, FocusRoundTrips) {
  Draw draw(5);
  for (int i = 0; i < 5000; ++i) {
    const double f = draw.FocalLength();
    const double z = draw.Beyond(f);
    const auto e = FocusExtension(Metres{f}, Metres{z});
    ASSERT_TRUE(e);
    ASSERT_LE(RelativeError(FocalPlaneDistance(Metres{f}, *e)->value, Exact(z)), 1e-14);
    ASSERT_LE(RelativeError(FocalPlane(Metres{f}, *e).value, 1 / Exact(z)), 1e-14);
  }
}

TEST(ConjugatesTest, NegativeExtensionIsFocusedPastInfinity) {
  EXPECT_EQ(FocalPlaneDistance(Metres{0.05}, Metres{-1e-4}), std::nullopt);
  EXPECT_LT(FocalPlane(Metres{0.05}, Metres{-1e-4}).value, 0.0);
  const auto e = FocusExtension(Metres{0.05}, FocalPlane(Metres{0.05}, Metres{-1e-4}));
  ASSERT_TRUE(e);
  EXPECT_NEAR(e->value, -1e-4, 1e-19);
}

TEST(ConjugatesTest, FocusingAtOrInsideTheFocalLengthNamesTheClosestFocus) {
  for (const double z : {0.05, 0.03, 1e-6}) {
    const auto e = FocusExtension(Metres{0.05}, Metres{z});
    ASSERT_FALSE(e) << z;
    EXPECT_EQ(e.error().code, Code::OutOfRange);
    EXPECT_THAT(e.error().message, ::testing::HasSubstr("closest focus is just beyond 50 mm"));
  }
  EXPECT_FALSE(FocusExtension(Metres{0.05}, Dioptres{20.0}));
  const auto limited = FocusExtension(Metres{0.05}, Dioptres{25.0}, Metres{0.005});
  ASSERT_FALSE(limited);
  EXPECT_THAT(limited.error().message, ::testing::HasSubstr("closest focus is 550 mm"));
}

TEST(ConjugatesTest, NumbersThatAreNoDepthAreRefused) {
  for (const double z : {0.0, -1.0, double(NAN)}) {
    const auto e = FocusExtension(Metres{0.05}, Metres{z});
    ASSERT_FALSE(e) << z;
    EXPECT_EQ(e.error().code, Code::InvalidArgument);
  }
  EXPECT_FALSE(FocusExtension(Metres{0.05}, Dioptres{NAN}));
  EXPECT_FALSE(FocusExtension(Metres{0.05}, Dioptres{INFINITY}));
  EXPECT_FALSE(FocusExtension(Metres{0.0}, Metres{1.0}));
  EXPECT_FALSE(FocusExtension(Metres{INFINITY}, Metres{1.0}));
}

}  // namespace
}  // namespace lensd::optics
