// The focal length for a framing, from each of the three origins of distance, against the magnification it must give.
#include "optics/framing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exact.h"
#include "optics/conjugates.h"

namespace lensd::optics {
namespace {

using testing::Draw;
using testing::Exact;
using testing::RelativeError;

constexpr ZoomRange kAny{Metres{1e-9}, Metres{1e9}};

TEST(FramingTest, FocusedOnTheFieldItFillsTheSensor) {
  Draw draw(31);
  for (int i = 0; i < 3000; ++i) {
    const double width = draw.Log(1e-3, 100);
    const double sensor = draw.Log(1e-3, 0.1);
    const double distance = draw.Log(0.1, 1000);
    const auto f = FramingFocalLength({Metres{width}, Metres{distance}, {}}, Metres{sensor}, kAny);
    ASSERT_TRUE(f);
    const Exact m = Exact(sensor) / Exact(width);
    ASSERT_LE(RelativeError(f->value, m * Exact(distance) / (1 + m)), 1e-14);
    const Metres e = Extension(*f, Metres{distance});
    ASSERT_NEAR(FieldWidth(*f, e, Metres{sensor}, Metres{distance}).value / width, 1.0, 1e-12);
  }
}

TEST(FramingTest, FromTheSensorTheWholePathIsCounted) {
  Draw draw(32);
  for (int i = 0; i < 3000; ++i) {
    const double width = draw.Log(1e-3, 100);
    const double sensor = draw.Log(1e-3, 0.1);
    const double distance = draw.Log(0.1, 1000);
    const FocusScale scale{DistanceFrom::Sensor, Metres{0.01}};
    const auto f = FramingFocalLength({Metres{width}, Metres{distance}, scale}, Metres{sensor}, kAny);
    ASSERT_TRUE(f);
    const double m = sensor / width;
    const double depth = f->value * (1 + 1 / m);
    ASSERT_NEAR((depth + f->value * (1 + m) + 0.01) / distance, 1.0, 1e-12);
  }
}

TEST(FramingTest, FromTheFrontTheLensIsAdded) {
  const FocusScale scale{DistanceFrom::Front, Metres{0}, Metres{0.1}};
  const auto f = FramingFocalLength({Metres{0.36}, Metres{0.9}, scale}, Metres{0.036}, kAny);
  ASSERT_TRUE(f);
  EXPECT_DOUBLE_EQ(f->value, 1.0 / 11.0);
}

TEST(FramingTest, FocusedElsewhereTheFieldChanges) {
  EXPECT_DOUBLE_EQ(FieldWidth(Metres{0.05}, Metres{0.0}, Metres{0.036}, Metres{5.0}).value, 3.6);
  EXPECT_DOUBLE_EQ(FieldWidth(Metres{0.05}, Metres{0.05}, Metres{0.036}, Metres{5.0}).value, 1.8);
}

TEST(FramingTest, OutsideTheZoomSaysWhatItCanFrame) {
  const ZoomRange zoom{Metres{0.024}, Metres{0.070}};
  const auto f = FramingFocalLength({Metres{0.5}, Metres{3.0}, {}}, Metres{0.036}, zoom);
  ASSERT_FALSE(f);
  EXPECT_EQ(f.error().code, Code::OutOfRange);
  EXPECT_THAT(f.error().message, ::testing::HasSubstr("needs a focal length of 201.493 mm"));
  EXPECT_THAT(f.error().message, ::testing::HasSubstr("it frames 1.50686 m to 4.464 m there"));
  EXPECT_TRUE(FramingFocalLength({Metres{2.0}, Metres{3.0}, {}}, Metres{0.036}, zoom));
}

TEST(FramingTest, RefusesLengthsThatAreNone) {
  EXPECT_FALSE(FramingFocalLength({Metres{0}, Metres{3.0}, {}}, Metres{0.036}, kAny));
  EXPECT_FALSE(FramingFocalLength({Metres{1}, Metres{INFINITY}, {}}, Metres{0.036}, kAny));
  EXPECT_FALSE(FramingFocalLength({Metres{1}, Metres{3.0}, {}}, Metres{-1}, kAny));
  const FocusScale thick{DistanceFrom::Sensor, Metres{0.5}};
  EXPECT_FALSE(FramingFocalLength({Metres{1}, Metres{0.4}, thick}, Metres{0.036}, kAny));
}

}  // namespace
}  // namespace lensd::optics
