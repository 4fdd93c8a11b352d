// No valid input makes a NaN, and only what the headers say makes an infinity.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>

#include "optics/blur.h"
#include "optics/conjugates.h"

namespace lensd::optics {
namespace {

/// Between 10^low and 10^high, every magnitude alike.
rc::Gen<double> Magnitude(int low, int high) {
  return rc::gen::map(rc::gen::inRange(low * 1000, high * 1000), [](int i) { return std::pow(10.0, i / 1000.0); });
}

rc::Gen<double> Distance(double focal_length) {
  return rc::gen::oneOf(rc::gen::just(double(INFINITY)), rc::gen::just(focal_length),
                        rc::gen::just(std::nextafter(focal_length, 0.0)),
                        rc::gen::just(std::nextafter(focal_length, 1e9)), Magnitude(-6, 15));
}

TEST(PropertiesTest, EverythingStaysFinite) {
  EXPECT_TRUE(rc::check([] {
    const double f = *Magnitude(-4, 1);
    const double n = *Magnitude(-1, 3);
    const double z = *Distance(f);
    const double e = *rc::gen::oneOf(Magnitude(-12, 1), rc::gen::just(0.0),
                                     rc::gen::map(Magnitude(-9, -1), [f](double part) { return -f * part; }));
    const ThinLens lens{Metres{f}, FNumber{n}, Metres{e}};
    RC_ASSERT(std::isfinite(SignedBlur(lens, Metres{z}).value));
    RC_ASSERT(std::isfinite(SignedBlur(lens, Dioptres{1.0 / z}).value));
    RC_ASSERT(std::isfinite(FocalPlane(Metres{f}, Metres{e}).value));
    if (const auto plane = FocalPlaneDistance(Metres{f}, Metres{e})) RC_ASSERT(std::isfinite(plane->value));
  }));
}

TEST(PropertiesTest, FocusIsEitherAnErrorOrFinite) {
  EXPECT_TRUE(rc::check([] {
    const double f = *Magnitude(-4, 1);
    const double z = *Distance(f);
    const auto e = FocusExtension(Metres{f}, Metres{z});
    RC_ASSERT(e.has_value() == (z > f));
    if (!e) return;
    RC_ASSERT(std::isfinite(e->value));
  }));
}

}  // namespace
}  // namespace lensd::optics
