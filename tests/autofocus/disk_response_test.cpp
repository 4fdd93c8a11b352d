// The blur disk's response against the sum over its chords.
#include "autofocus/defocus/disk_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace lensd::autofocus {
namespace {

/// What a uniform disk leaves of cos(2 pi f x), by adding up its chords.
double DiskByChords(double turns) {
  constexpr int kChords = 40000;
  double sum = 0.0;
  for (int i = 0; i < kChords; ++i) {
    const double angle = std::numbers::pi * (i + 0.5) / kChords;  // x = cos(angle)/2, chord sin(angle), dx = sin/2
    const double chord = std::sin(angle) * std::sin(angle);
    sum += chord * std::cos(std::numbers::pi * turns * std::cos(angle));
  }
  return 2.0 * sum / kChords;
}

TEST(DiskResponse, EqualsTheSumOverChords) {
  for (const double turns : {0.0, 0.01, 0.3, 1.0, 1.2197, 2.5, 6.2, 6.5, 17.3, 80.1, 199.0}) {
    EXPECT_NEAR(defocus::DiskResponse(turns), DiskByChords(turns), 2e-5) << turns;
    EXPECT_EQ(defocus::DiskResponse(-turns), defocus::DiskResponse(turns));
  }
}

}  // namespace
}  // namespace lensd::autofocus
