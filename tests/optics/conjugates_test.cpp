// Focusing and back, within a few units in the last place; what cannot be focused is refused with the reason.
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
