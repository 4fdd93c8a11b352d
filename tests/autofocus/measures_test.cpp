// Focus measures against closed forms.
#include "autofocus/measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "autofocus/measures/measure_scalar.h"

namespace lensd::autofocus {
namespace {

drivers::Frame MakeFrame(int width, int height, int bits, const std::function<double(int, int)>& sample) {
  auto samples = std::make_shared<std::vector<std::uint16_t>>();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) samples->push_back(static_cast<std::uint16_t>(std::lround(sample(x, y))));
  }
  drivers::Frame frame;
  frame.width = width;
  frame.height = height;
  frame.bits = bits;
  frame.samples = samples;
  return frame;
}

/// Pictures of 8 bits as the sums of bytes take them.
class Bytes {
 public:
  explicit Bytes(const drivers::Frame& frame)
      : samples_(frame.samples->begin(), frame.samples->end()), width_(frame.width), height_(frame.height) {}
  GreyView<std::uint8_t> view() const { return {samples_.data(), width_, height_, width_}; }

 private:
  std::vector<std::uint8_t> samples_;
  int width_, height_;
};

TEST(Measures, RampHasItsSlopeSquared) {
  const auto frame = MakeFrame(40, 30, 8, [](int x, int y) { return 3 * x + 2 * y; });
  const auto score = ScoreFocus(frame, {2, 3, 20, 10});
  ASSERT_TRUE(score);
  EXPECT_NEAR(score->gradient_energy, (9.0 + 4.0) / (255.0 * 255.0), 1e-15);
  EXPECT_EQ(score->noise, 0.0);
  EXPECT_NEAR(score->mean, (3 * 11.5 + 2 * 7.5) / 255.0, 1e-12);
  const Bytes bytes(frame);
  const GreyView<std::uint8_t> view = bytes.view();
  EXPECT_EQ(SumGradient(view), 64u * (9 + 4) * 38 * 28);
  EXPECT_EQ(SumBrenner(view), 4u * 9 * 38 * 30);
  EXPECT_EQ(SumLaplacian(view), LaplacianSums());
}

TEST(Measures, CheckerboardLaplacian) {
  const Bytes bytes(MakeFrame(32, 32, 8, [](int x, int y) { return (x + y) % 2 == 0 ? 200 : 100; }));
  EXPECT_EQ(SumLaplacian(bytes.view()), (LaplacianSums{.value = 0, .square = 400u * 400u * 30 * 30}));
}

TEST(Measures, NoiseOfNormalSamples) {
  // A sum of twelve uniform numbers is near enough to normal.
  std::uint32_t state = 1;
  auto uniform = [&] { return static_cast<double>((state = state * 1664525u + 1013904223u) >> 8) / 16777216.0; };
  const auto frame = MakeFrame(300, 300, 16, [&](int, int) {
    double sum = 0.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return 30000.0 + 655.35 * (sum - 6.0);
  });
  const auto score = ScoreFocus(frame, {0, 0, 300, 300});
  EXPECT_NEAR(score->noise, 0.01, 0.0003);
  EXPECT_NEAR(score->gradient_energy, 0.375e-4, 0.02e-4);
}

TEST(Measures, CountsSaturatedSamples) {
  const auto frame = MakeFrame(20, 10, 12, [](int x, int y) { return y == 4 && x < 6 ? 4095 : 4094; });
  EXPECT_NEAR(ScoreFocus(frame, {0, 0, 20, 10})->saturated_fraction, 6.0 / 200.0, 1e-15);
}

/// The sums of vectors against those of single samples, for noise and for the steepest pictures there can be.
template <class Sample>
void ExpectScalarSums(int width, int height, std::uint32_t largest, bool extreme, std::uint32_t& state) {
  std::vector<Sample> samples;
  for (int i = 0; i < width * height; ++i) {
    state = state * 1664525u + 1013904223u;
    const std::uint32_t random = (state >> 8) % (largest + 1);
    samples.push_back(static_cast<Sample>(extreme ? (i / 2 + i / width / 2) % 2 * largest : random));
  }
  const GreyView<Sample> view{samples.data(), width, height, width};
  const auto full = static_cast<Sample>(largest - largest / 50);
  const auto slopes = [](GreyView<Sample> part, scalar::Noise noise) { return scalar::SlopesOf(part, noise); };
  const FocusSums expected = scalar::ByBands(
      view, slopes, [&](const Sample* row, FocusSums& sums) { scalar::AddLevels(row, width, full, sums); });
  EXPECT_EQ(SumFocus(view, full), expected) << width << ' ' << largest;
  if constexpr (sizeof(Sample) == 1) {
    EXPECT_EQ(SumGradient(view), slopes(view, scalar::Noise::LeftOut).gradient) << width << ' ' << largest;
    EXPECT_EQ(SumBrenner(view), scalar::BrennerOf(view)) << width << ' ' << largest;
    EXPECT_EQ(SumLaplacian(view), scalar::LaplacianOf(view)) << width << ' ' << largest;
  }
}

TEST(Measures, VectorsSumWhatSingleSamplesSum) {
  std::uint32_t state = 9;
  for (const auto& [width, height] : {std::pair(3, 3), {9, 40}, {17, 4}, {34, 9}, {129, 35}, {1923, 21}, {1923, 131}}) {
    for (const bool extreme : {false, true}) {
      ExpectScalarSums<std::uint8_t>(width, height, 255, extreme, state);
      for (const std::uint32_t largest : {255u, 1023u, 4095u, 4096u, 65535u}) {
        ExpectScalarSums<std::uint16_t>(width, height, largest, extreme, state);
      }
    }
  }
}

TEST(Measures, WindowMustFit) {
  const auto frame = MakeFrame(20, 10, 8, [](int, int) { return 1; });
  EXPECT_TRUE(ScoreFocus(frame, {17, 7, 3, 3}));
  for (const Window bad : {Window{0, 0, 2, 3}, {18, 0, 3, 3}, {-1, 0, 5, 5}, {0, 8, 5, 3}, {0, 0, 21, 10}}) {
    const auto refused = ScoreFocus(frame, bad);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, Code::InvalidArgument);
  }
}

}  // namespace
}  // namespace lensd::autofocus
