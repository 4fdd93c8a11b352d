// Regions whose light is not their own: almost without texture, beside a structure whose blur reaches into them; and
// regions of which a part is cut off at full scale where it is in focus. Pictures are drawn by spreading each pixel
// evenly over a disk, so the truth is where the disks have no size.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "autofocus/session.h"
#include "test_level.h"

namespace lensd::autofocus {
namespace {

constexpr double kApart = 4.0;  // px of blur: farther off an answer is false

class Chance {
 public:
  explicit Chance(unsigned seed) : random_(seed) {}
  double operator()(double from, double to) {
    return from + (to - from) * static_cast<double>(random_()) / 4294967296.0;
  }
  int Whole(int from, int to) { return static_cast<int>(std::floor((*this)(from, to + 1.0))); }
  bool OneIn(double times) { return (*this)(0.0, times) < 1.0; }
  std::mt19937& generator() { return random_; }

 private:
  std::mt19937 random_;
};

/// Light by pixel, each pixel even.
struct Canvas {
  int width = 0, height = 0;
  std::vector<double> light;
  Canvas(int w, int h, double value) : width(w), height(h), light(static_cast<std::size_t>(w * h), value) {}
  double& At(int x, int y) { return light[static_cast<std::size_t>(y * width + x)]; }
  double At(int x, int y) const { return light[static_cast<std::size_t>(y * width + x)]; }
  void Add(const Window& part, double value) {
    for (int y = std::max(part.y, 0); y < std::min(part.y + part.height, height); ++y) {
      for (int x = std::max(part.x, 0); x < std::min(part.x + part.width, width); ++x) At(x, y) += value;
    }
  }
};

/// Spread over a disk, in `part`: row by row of the disk, by sums along the rows of the picture.
Canvas Blurred(const Canvas& sharp, double diameter, const Window& part) {
  const double radius = 0.5 * std::abs(diameter);
  if (radius < 0.3) return sharp;
  const int width = sharp.width, height = sharp.height;
  std::vector<double> sums(static_cast<std::size_t>((width + 1) * height), 0.0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      sums[static_cast<std::size_t>(y * (width + 1) + x + 1)] =
          sums[static_cast<std::size_t>(y * (width + 1) + x)] + sharp.At(x, y);
  }
  const int rows = std::max(5, static_cast<int>(std::ceil(2.5 * radius)));
  Canvas spread = sharp;
  const int left = std::max(part.x, 0), right = std::min(part.x + part.width, width);
  const int top = std::max(part.y, 0), bottom = std::min(part.y + part.height, height);
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) spread.At(x, y) = 0.0;
  }
  double area = 0.0;
  for (int k = 0; k < rows; ++k) {
    const double off = radius * ((2.0 * k + 1.0) / rows - 1.0), half = std::sqrt(radius * radius - off * off);
    area += 2.0 * half;
    for (int y = top; y < bottom; ++y) {
      const int from = std::clamp(static_cast<int>(std::lround(y + off)), 0, height - 1);
      const double* row = sums.data() + static_cast<std::ptrdiff_t>(from) * (width + 1);
      const auto until = [&](double x) {
        const double at = std::clamp(x, 0.0, static_cast<double>(width));
        const int whole = std::min(static_cast<int>(at), width - 1);
        // What lies beyond the canvas is as its rim is.
        return std::lerp(row[whole], row[whole + 1], at - whole) + (x < 0.0 ? x * row[1] : 0.0) +
               (x > width ? (x - width) * (row[width] - row[width - 1]) : 0.0);
      };
      for (int x = left; x < right; ++x) spread.At(x, y) += until(x + 0.5 + half) - until(x + 0.5 - half);
    }
  }
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) spread.At(x, y) /= area;
  }
  return spread;
}

/// One depth.
struct Layer {
  Canvas canvas;
  double focus = 0.0;
};

struct Scene {
  std::vector<Layer> layers;  ///< their light adds up
  Window region;
  int margin = 0;        ///< of the canvas, beyond the frame
  double electrons = 0;  ///< at full scale
  double gain = 1.0;
  int bits = 8;

  drivers::Frame Picture(double position, unsigned seed) const {
    const int width = layers.front().canvas.width - 2 * margin, height = layers.front().canvas.height - 2 * margin;
    constexpr int kSeen = 36;  // px around the region: nothing looks farther off
    const Window seen{region.x + margin - kSeen, region.y + margin - kSeen, region.width + 2 * kSeen,
                      region.height + 2 * kSeen};
    Canvas sum(layers.front().canvas.width, layers.front().canvas.height, 0.0);
    for (const Layer& layer : layers) {
      const Canvas one = Blurred(layer.canvas, position - layer.focus, seen);
      for (std::size_t i = 0; i < sum.light.size(); ++i) sum.light[i] += one.light[i];
    }
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const double full = std::exp2(bits) - 1.0;
    std::vector<std::uint16_t> samples;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double light = gain * std::max(sum.At(x + margin, y + margin), 0.0);
        const double noisy = light + normal(random) * std::sqrt(light / electrons + 9.0 / (electrons * electrons));
        samples.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(noisy, 0.0, 1.0) * full)));
      }
    }
    drivers::Frame frame;
    frame.width = width;
    frame.height = height;
    frame.bits = bits;
    frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
    return frame;
  }
};

constexpr double kLowest = -40.0, kHighest = 40.0;

struct Outcome {
  Verdict verdict;
  int frames = 0;
};

Outcome SearchIn(const Scene& scene, const char* method, double start, unsigned seed) {
  const Setup setup{.lowest = kLowest, .highest = kHighest, .resolution = 0.05, .blur_px = 1.0, .ascending = true};
  auto session = Session::Create(method, setup);
  Outcome run;
  double position = start;
  while (run.frames < 150) {
    const auto frame = scene.Picture(position, 1000 * seed + static_cast<unsigned>(++run.frames));
    const Window& r = scene.region;
    const auto advice =
        session->Next(position, frame,
                      {static_cast<double>(r.x) / frame.width, static_cast<double>(r.y) / frame.height,
                       static_cast<double>(r.width) / frame.width, static_cast<double>(r.height) / frame.height});
    if (const auto* verdict = std::get_if<Verdict>(&*advice)) {
      run.verdict = *verdict;
      return run;
    }
    position = std::get<GoAndLook>(*advice).position;
  }
  ADD_FAILURE() << "never came to an end";
  return run;
}

/// Rectangles, bars, lines or points, lighter and darker, where `allowed` says so.
template <class Allowed>
void DrawStructure(Chance& draw, Canvas& canvas, double contrast, const Allowed& allowed) {
  const int kind = draw.Whole(0, 2);
  const double density = draw(0.3, 1.5);
  const double size_px = kind == 0 ? draw(4.0, 14.0) : kind == 1 ? draw(1.5, 4.0) : 1.5;
  const int count = static_cast<int>(density * canvas.width * canvas.height / (size_px * size_px * 4.0)) + 1;
  Canvas drawn(canvas.width, canvas.height, 0.0);
  for (int i = 0; i < count; ++i) {
    const int width = std::max(1, static_cast<int>(draw(0.5, 1.5) * size_px));
    const int height = kind == 1 ? draw.Whole(8, 30) : std::max(1, static_cast<int>(draw(0.5, 1.5) * size_px));
    drawn.Add({draw.Whole(0, canvas.width - 1), draw.Whole(0, canvas.height - 1), width, height},
              contrast * (draw.OneIn(2.0) ? 1.0 : -1.0) * draw(0.4, 1.0));
  }
  for (int y = 0; y < canvas.height; ++y) {
    for (int x = 0; x < canvas.width; ++x) {
      if (allowed(x, y)) canvas.At(x, y) += std::clamp(drawn.At(x, y), -contrast, contrast);
    }
  }
}

/// A region of 16 to 40 px with 0 to 3 % of texture of its own, and a structure 0 to 20 px beside it.
Scene BesideAStructure(Chance& draw) {
  constexpr int kFrame = 128;
  Scene scene;
  scene.margin = 24;
  const int side = kFrame + 2 * scene.margin;
  scene.region = {0, 0, draw.Whole(16, 40), draw.Whole(16, 40)};
  scene.region.x = draw.Whole(24, kFrame - 24 - scene.region.width);
  scene.region.y = draw.Whole(24, kFrame - 24 - scene.region.height);
  const int sides = draw.Whole(1, 15), apart = draw.Whole(0, 20);
  const Window& r = scene.region;
  const auto outside = [&](int x, int y) {
    const int left = r.x + scene.margin - x, right = x - (r.x + r.width - 1 + scene.margin);
    const int above = r.y + scene.margin - y, below = y - (r.y + r.height - 1 + scene.margin);
    return ((sides & 1) != 0 && left > apart) || ((sides & 2) != 0 && right > apart) ||
           ((sides & 4) != 0 && above > apart) || ((sides & 8) != 0 && below > apart);
  };
  const double focus = draw(kLowest + 4.0, kHighest - 4.0);
  Canvas near(side, side, 0.5), own(side, side, 0.0);
  DrawStructure(draw, near, draw(0.08, 0.4), outside);
  const double contrast = draw.OneIn(3.0) ? 0.0 : draw(0.0, 0.015);
  if (contrast > 0.0) DrawStructure(draw, own, contrast, [&](int x, int y) { return !outside(x, y); });
  const double other = draw.OneIn(2.0) ? focus : draw(kLowest - 5.0, kHighest + 5.0);
  scene.layers = {{near, other}, {own, focus}};
  scene.electrons = draw.OneIn(2.0) ? draw(1500.0, 10000.0) : draw(10000.0, 60000.0);
  scene.gain = draw(0.3, 0.95);
  scene.bits = draw.OneIn(2.0) ? 8 : 12;
  return scene;
}

/// A textured wall of which 5 to 40 % of the region are cut off in focus, some with lamps before it or at its depth.
Scene Clipped(Chance& draw) {
  constexpr int kFrame = 128;
  Scene scene;
  scene.margin = 16;
  const int side = kFrame + 2 * scene.margin;
  scene.region = {0, 0, draw.Whole(16, 40), draw.Whole(16, 40)};
  if (draw.OneIn(2.0)) scene.region = {0, 0, draw.Whole(40, 110), draw.Whole(40, 110)};
  scene.region.x = draw.Whole(0, kFrame - scene.region.width);
  scene.region.y = draw.Whole(0, kFrame - scene.region.height);
  const auto everywhere = [](int, int) { return true; };
  const double focus = draw(kLowest + 4.0, kHighest - 4.0);
  Canvas wall(side, side, 0.5);
  const double contrast = draw(0.1, 0.45);
  DrawStructure(draw, wall, contrast, everywhere);
  DrawStructure(draw, wall, contrast * draw(0.1, 0.7), everywhere);
  std::vector<double> values;
  for (int y = 0; y < scene.region.height; ++y) {
    for (int x = 0; x < scene.region.width; ++x)
      values.push_back(wall.At(x + scene.region.x + scene.margin, y + scene.region.y + scene.margin));
  }
  std::ranges::sort(values);
  const double share = draw(0.05, 0.4);
  scene.gain = 0.999 / values[static_cast<std::size_t>((1.0 - share) * static_cast<double>(values.size() - 1))];
  Canvas lamps(side, side, 0.0);
  const double lamp_focus = draw.OneIn(2.0) ? focus : draw(kLowest, kHighest);
  if (draw.OneIn(4.0)) {
    for (int n = draw.Whole(1, 3); n > 0; --n) {
      lamps.Add(
          {scene.region.x + scene.margin + draw.Whole(0, scene.region.width),
           scene.region.y + scene.margin + draw.Whole(0, scene.region.height), draw.Whole(1, 4), draw.Whole(1, 4)},
          draw(2.0, 40.0));
    }
    scene.gain *= draw(0.4, 0.8);
  }
  scene.layers = {{wall, focus}, {lamps, lamp_focus}};
  scene.electrons = draw(2000.0, 30000.0);
  scene.bits = draw.OneIn(2.0) ? 8 : 12;
  return scene;
}

struct Count {
  long within = 0, wrong = 0, answered = 0;
  std::string wrong_ones;
};

void Judge(Count& count, const Outcome& run, const Scene& scene, unsigned seed) {
  double off = std::numeric_limits<double>::infinity();
  for (const Layer& layer : scene.layers) off = std::min(off, std::abs(run.verdict.position - layer.focus));
  count.answered += run.verdict.focused ? 1 : 0;
  count.within += run.verdict.focused && off <= kHalfDepthOfFieldPx ? 1 : 0;
  if (!run.verdict.focused || off <= kApart) return;
  ++count.wrong;
  count.wrong_ones += "\n" + std::to_string(seed) + ": at " + std::to_string(run.verdict.position) + ", not " +
                      std::to_string(scene.layers.back().focus) + "/" + std::to_string(scene.layers.front().focus) +
                      ": " + run.verdict.reason;
}

TEST(ForeignLight, BlurOfAStructureBesideTheRegionIsNoTexture) {
  const long draws = lensd::testing::ByLevel(5, 12, 1000);
  Count count;
  constexpr unsigned kFirst = 228;  // believing blur from outside answers falsely in this draw, and in some 2 % of all
  for (unsigned seed = kFirst; seed < kFirst + draws; ++seed) {
    Chance draw(80000 + seed);
    const Scene scene = BesideAStructure(draw);
    const char* method = draw.OneIn(2.0) ? "auto" : "sweep";
    Judge(count, SearchIn(scene, method, draw(kLowest, kHighest), seed), scene, seed);
  }
  std::printf("%ld draws: %ld answered, %ld within, %ld false\n", draws, count.answered, count.within, count.wrong);
  EXPECT_EQ(count.wrong, 0) << count.wrong_ones;
}

TEST(ForeignLight, WhatIsLeftOfAClippedRegionIsNotBelievedAgainstTheRest) {
  const long draws = lensd::testing::ByLevel(5, 12, 1000);
  Count count;
  constexpr unsigned kFirst = 39;  // believing what is left answers falsely in this draw, and in some 3 % of all
  for (unsigned seed = kFirst; seed < kFirst + draws; ++seed) {
    Chance draw(90000 + seed);
    const Scene scene = Clipped(draw);
    const char* method = draw.OneIn(2.0) ? "auto" : "sweep";
    Judge(count, SearchIn(scene, method, draw(kLowest, kHighest), seed), scene, seed);
  }
  std::printf("%ld draws: %ld answered, %ld within, %ld false\n", draws, count.answered, count.within, count.wrong);
  EXPECT_EQ(count.wrong, 0) << count.wrong_ones;
}

}  // namespace
}  // namespace lensd::autofocus
