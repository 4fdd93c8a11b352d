// Whole maps on frames that are made here: a texture in many states of blur, of which each pixel shows the one that its
// own place of focus asks for. Where that is, is drawn at random, and is the truth.
#include "autofocus/focus_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace lensd::autofocus {
namespace {

constexpr int kFrameWidth = 240, kFrameHeight = 180;
constexpr double kMicrometre = 1e-6, kBlurPx = 10 * kMicrometre;  ///< of extension, of a pixel of blur: f/2 with 5 um
constexpr double kLevel = 0.5;                                    ///< px of blur between two states
constexpr int kLevels = 121;

/// Light of every pixel, blurred by Gaussians as wide as disks of 0, 0.5, 1 .. 60 px are.
class Texture {
 public:
  explicit Texture(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> light(0.1F, 0.9F);
    levels_.assign(kLevels, std::vector<float>(kFrameWidth * kFrameHeight));
    for (float& value : levels_[0]) value = light(random);
    for (int level = 1; level < kLevels; ++level) Blur(level * kLevel / 4.0, levels_[static_cast<std::size_t>(level)]);
  }
  float At(std::size_t pixel, double blur_px) const {
    const double level = std::min(blur_px / kLevel, kLevels - 1.001);
    const auto low = static_cast<std::size_t>(level);
    const auto part = static_cast<float>(level - static_cast<double>(low));
    return levels_[low][pixel] * (1.0F - part) + levels_[low + 1][pixel] * part;
  }

 private:
  void Blur(double sigma, std::vector<float>& out) const {
    const int reach = static_cast<int>(std::ceil(3.0 * sigma));
    std::vector<float> kernel;
    float sum = 0.0F;
    for (int i = -reach; i <= reach; ++i) {
      kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
      sum += kernel.back();
    }
    std::vector<float> rows(out.size());
    const auto pass = [&](const std::vector<float>& from, std::vector<float>& to, int step_x, int step_y) {
      for (int y = 0; y < kFrameHeight; ++y) {
        for (int x = 0; x < kFrameWidth; ++x) {
          float value = 0.0F;
          for (int i = -reach; i <= reach; ++i) {
            const int from_x = (x + i * step_x + 8 * kFrameWidth) % kFrameWidth;
            const int from_y = (y + i * step_y + 8 * kFrameHeight) % kFrameHeight;
            value += kernel[static_cast<std::size_t>(i + reach)] *
                     from[static_cast<std::size_t>(from_y * kFrameWidth + from_x)];
          }
          to[static_cast<std::size_t>(y * kFrameWidth + x)] = value / sum;
        }
      }
    };
    pass(levels_[0], rows, 1, 0);
    pass(rows, out, 0, 1);
  }
  std::vector<std::vector<float>> levels_;
};

const Texture& SharedTexture() {
  static const Texture texture(3);
  return texture;
}

/// Extension at which a pixel is in focus, x and y in half diagonals from the middle; negative: it shows nothing.
using FocusOf = std::function<double(double x, double y)>;

class Camera {
 public:
  Camera(const FocusOf& focus, unsigned seed) : random_(seed) {
    for (int y = 0; y < kFrameHeight; ++y) {
      for (int x = 0; x < kFrameWidth; ++x) {
        focus_.push_back(focus((x + 0.5 - 120.0) / 150.0, (y + 0.5 - 90.0) / 150.0));
      }
    }
  }
  drivers::Frame At(double extension) {
    auto samples = std::make_shared<std::vector<std::uint16_t>>();
    for (std::size_t i = 0; i < focus_.size(); ++i) {
      const double light =
          focus_[i] < 0.0 ? 0.5 : static_cast<double>(SharedTexture().At(i, std::abs(extension - focus_[i]) / kBlurPx));
      samples->push_back(
          static_cast<std::uint16_t>(std::clamp(std::lround(255.0 * light + noise_(random_)), 0L, 254L)));
    }
    drivers::Frame frame;
    frame.width = kFrameWidth;
    frame.height = kFrameHeight;
    frame.bits = 8;
    frame.samples = std::move(samples);
    return frame;
  }

 private:
  std::vector<double> focus_;
  std::mt19937 random_;
  std::normal_distribution<double> noise_{0.0, 2.0};
};

Setup LensSetup() {
  return {.lowest = 300e-6, .highest = 900e-6, .resolution = 0.3e-6, .blur_px = kBlurPx};
}

struct MapRun {
  std::unique_ptr<RegionSearch> search;
  Verdict verdict;
  const FocusMap& map() const { return *search->map(); }
};

/// `disturb`, if given, changes what the last frame is taken of: the one at the best common focus.
MapRun MapOf(const FocusOf& focus, unsigned seed, const FocusOf& at_last = nullptr) {
  MapRun run{.search = *MakeMapSearch(LensSetup(), {}), .verdict = {}};
  Camera camera(focus, seed), other(at_last ? at_last : focus, seed + 1000);
  double stands = 450e-6;
  for (int frame = 0; frame < 500; ++frame) {
    const bool last = run.search->map() != nullptr;
    const auto advice = run.search->Next(Place(stands), (last ? other : camera).At(stands));
    EXPECT_TRUE(advice);
    if (const auto* verdict = std::get_if<Verdict>(&*advice)) {
      run.verdict = *verdict;
      return run;
    }
    stands = std::get<GoAndLook>(*advice).position;
  }
  ADD_FAILURE() << "it does not end";
  return run;
}

FocusOf Bowl(double middle, double across, double down, double bowl) {
  return [=](double x, double y) { return middle + across * x + down * y + bowl * (x * x + y * y); };
}

TEST(FocusMapSearch, FindsTiltAndCurvatureWithinItsErrors) {
  std::mt19937 random(20);
  std::uniform_real_distribution<double> slope(-40.0, 40.0), middle(480.0, 720.0);
  int within1 = 0, within2 = 0, all = 0, most_frames = 0;
  double worst = 0.0, largest_sigma = 0.0;
  constexpr int kDraws = 40;
  for (int draw = 0; draw < kDraws; ++draw) {
    const std::array<double, 4> truth = {middle(random), slope(random), slope(random), slope(random)};
    const MapRun run =
        MapOf(Bowl(truth[0] * kMicrometre, truth[1] * kMicrometre, truth[2] * kMicrometre, truth[3] * kMicrometre),
              static_cast<unsigned>(draw));
    ASSERT_TRUE(run.verdict.focused) << run.verdict.reason;
    const FocusSurface& found = *run.map().surface;
    ASSERT_TRUE(found.curved);
    for (std::size_t i = 0; i < 4; ++i) {
      const double off = std::abs(found.terms[i] / kMicrometre - truth[i]) / (found.sigmas[i] / kMicrometre);
      within1 += off < 1.0;
      within2 += off < 2.0;
      ++all;
      worst = std::max(worst, off);
      largest_sigma = std::max(largest_sigma, found.sigmas[i] / kMicrometre);
    }
    most_frames = std::max(most_frames, run.search->frames());
  }
  printf(
      "%d maps by at most %d frames: %.0f and %.0f %% of the terms within 1 and 2 sigma, worst %.1f, no sigma above "
      "%.2f um\n",
      kDraws, most_frames, 100.0 * within1 / all, 100.0 * within2 / all, worst, largest_sigma);
  EXPECT_GE(within1, 0.55 * all);
  EXPECT_GE(within2, 0.88 * all);
  EXPECT_LT(worst, 4.5);
  EXPECT_LT(largest_sigma, 3.0);
  EXPECT_LE(most_frames, 60);
}

TEST(FocusMapSearch, StandsWhereTheFrameIsLeastOutOfFocus) {
  const MapRun run = MapOf(Bowl(600e-6, 40e-6, 0.0, 0.0), 1);
  ASSERT_TRUE(run.verdict.focused) << run.verdict.reason;
  EXPECT_NEAR(run.verdict.position, 600e-6, 2e-6);
  // The outermost regions' middles are 0.64 half diagonals from the middle.
  EXPECT_NEAR(run.map().left, 0.64 * 40e-6, 3e-6);
}

TEST(FocusMapSearch, NamesWhatItLeavesOut) {
  // Regions are 0.32 by 0.3; the first shows nothing, the last is elsewhere, one in the middle is at two depths.
  const MapRun run = MapOf(
      [](double x, double y) {
        if (x < -0.48 && y < -0.3) return -1.0;
        if (x > 0.48 && y > 0.3) return 500e-6;
        if (std::abs(x) < 0.16 && y > 0.0 && y < 0.3) return x < 0.0 ? 480e-6 : 720e-6;
        return 600e-6;
      },
      2);
  ASSERT_TRUE(run.verdict.focused) << run.verdict.reason;
  for (std::size_t i = 0; i < 20; ++i) {
    const MapCell& cell = run.map().cells[i];
    SCOPED_TRACE(::testing::Message() << "cell " << i << ": " << cell.reason);
    if (i == 0) {
      EXPECT_FALSE(cell.position);
      EXPECT_EQ(cell.cause, Cause::NoTexture);
    } else if (i == 19) {
      ASSERT_TRUE(cell.position);
      EXPECT_TRUE(cell.outlier);
      EXPECT_NEAR(cell.off, -100e-6, 10e-6);
    } else if (i == 12) {
      EXPECT_TRUE(cell.outlier || cell.cause == Cause::SeveralDepths);
    } else {
      EXPECT_TRUE(cell.position && !cell.outlier);
    }
  }
  EXPECT_EQ(run.map().surface->used, 17);
}

TEST(FocusMapSearch, RefusesBlankTargetsSeveralDepthsAndChanges) {
  const MapRun blank = MapOf([](double, double) { return -1.0; }, 3);
  EXPECT_FALSE(blank.verdict.focused);
  EXPECT_EQ(blank.verdict.cause, Cause::NoTexture);
  EXPECT_NE(blank.verdict.reason.find("0 of 20"), std::string::npos) << blank.verdict.reason;
  const MapRun halves = MapOf([](double x, double) { return x < -0.16 ? 450e-6 : 750e-6; }, 4);
  EXPECT_FALSE(halves.verdict.focused);
  EXPECT_EQ(halves.verdict.cause, Cause::SeveralDepths) << halves.verdict.reason;
  EXPECT_EQ(halves.map().cells.size(), 20u);
  EXPECT_FALSE(halves.map().surface);
  const MapRun beyond = MapOf(Bowl(960e-6, 0.0, 0.0, 0.0), 5);
  EXPECT_FALSE(beyond.verdict.focused);
  EXPECT_EQ(beyond.verdict.cause, Cause::EndOfTravel) << beyond.verdict.reason;
  const MapRun moved = MapOf(Bowl(600e-6, 0.0, 0.0, 0.0), 6, Bowl(700e-6, 0.0, 0.0, 0.0));
  EXPECT_FALSE(moved.verdict.focused);
  EXPECT_NE(moved.verdict.reason.find("less sharp than the search promised"), std::string::npos)
      << moved.verdict.reason;
}

TEST(FocusMapSearch, AFrameThatRepeatsItselfIsNamed) {
  const auto search = *MakeMapSearch(LensSetup(), {});
  Camera camera(Bowl(600e-6, 0.0, 0.0, 0.0), 7);
  const drivers::Frame frame = camera.At(400e-6);
  ASSERT_TRUE(search->Next(Place(400e-6), frame));
  const auto advice = search->Next(Place(410e-6), frame);
  ASSERT_TRUE(advice && std::holds_alternative<Verdict>(*advice));
  EXPECT_EQ(std::get<Verdict>(*advice).cause, Cause::SameFrame);
}

}  // namespace
}  // namespace lensd::autofocus
