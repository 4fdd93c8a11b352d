// Blur below a pixel is blur. Every renderer from outside, against what physics says of gratings, steps and scenes with
// known edges; nothing here is shared with the renderers but the scenes.
//
// A texture's samples are pixel means of a band-limited picture. A disk of diameter b multiplies a wave of period p by
// 2 J1(x)/x, x = pi b/p, whatever the pixels are.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <random>

#include "render_scenes.h"
#include "test_level.h"

namespace lensd::sim {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

double Disk(double diameter, double period) {
  const double x = std::numbers::pi * std::abs(diameter) / period;
  return x < 1e-6 ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
}

/// A wave across the picture along x or y, and its mean over a pixel.
struct Wave {
  double period = 8.0;
  double phase = 0.0;
  bool down = false;
  double amplitude = 0.4;

  double At(double x, double y) const { return 0.5 + amplitude * std::cos(kTurn * (down ? y : x) / period + phase); }
  double PixelMean(int x, int y) const {
    const double half = std::numbers::pi / period;
    return 0.5 + std::sin(half) / half * (At(x + 0.5, y + 0.5) - 0.5);
  }
};

TexturePaint TextureOf(int width, int height, const std::function<double(int, int)>& light) {
  auto texture = std::make_shared<Texture>(Texture{width, height, {}});
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) texture->light.push_back(static_cast<float>(light(x, y)));
  }
  return {texture, 1.0, false};
}

TexturePaint TextureOf(int width, int height, const Wave& wave) {
  return TextureOf(width, height, [&](int x, int y) { return wave.PixelMean(x, y); });
}

constexpr int kLength = 200;  // along the wave
constexpr int kBorder = 40;   // px at each end that are not looked at
constexpr int kAcross = 6;

/// A grating that repeats a whole number of times between the borders, seen through a lens that blurs it.
struct Grating {
  Scene scene;
  Wave wave;
  int repeats;
};

Grating GratingOf(std::mt19937& random, bool down) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const int inner = kLength - 2 * kBorder;
  const int repeats = std::uniform_int_distribution(8, 48)(random);  // periods of 2.5 to 15 px
  Grating grating{down ? EmptyScene(kAcross, kLength) : EmptyScene(kLength, kAcross),
                  {static_cast<double>(inner) / repeats, uniform(0.0, kTurn), down},
                  repeats};
  grating.scene.surfaces.push_back(
      Wall(1.0, TextureOf(grating.scene.camera.width, grating.scene.camera.height, grating.wave)));
  return grating;
}

/// The wave's share in pixels [from, from + count) along it, of one line: in phase and a quarter period off.
std::complex<double> ShareOf(const Wave& wave, int from, int count, const std::function<double(int)>& light) {
  std::complex<double> sum = 0.0;
  for (int i = from; i < from + count; ++i) {
    sum += 2.0 / count * (light(i) - 0.5) * std::polar(1.0, -(kTurn * (i + 0.5) / wave.period + wave.phase));
  }
  return sum;
}

std::function<double(int)> LineOf(const LightImage& image, bool down) {
  return [&image, down](int i) {
    const int x = down ? image.width / 2 : i, y = down ? i : image.height / 2;
    return static_cast<double>(image.light[static_cast<std::size_t>(y * image.width + x)]);
  };
}

struct Way {
  Algorithm algorithm;
  int rays;
  int gratings;
};
constexpr Way kWays[] = {{Algorithm::Auto, 0, 150},
                         {Algorithm::Gather, 0, 60},
                         {Algorithm::Layers, 0, 60},
                         {Algorithm::March, 1500, 24},
                         {Algorithm::Rays, 1500, 12}};

TEST(Subpixel, GratingsKeepWhatPhysicsSays) {
  std::mt19937 random(20);
  for (const Way& way : kWays) {
    const RenderOptions options{.algorithm = way.algorithm, .rays_per_pixel = std::max(1, way.rays)};
    double worst = 0.0, quadrature = 0.0;
    for (int i = 0; i < way.gratings; ++i) {
      const Grating grating = GratingOf(random, i % 2 == 1);
      const double blur = std::uniform_real_distribution(-6.0, 6.0)(random);
      const LightImage sharp = Render(grating.scene, Blurred(grating.scene, 0.0, 1.0), options);
      const LightImage blurred = Render(grating.scene, Blurred(grating.scene, blur, 1.0), options);
      const int inner = kLength - 2 * kBorder;
      const auto share = [&](const LightImage& image) {
        return ShareOf(grating.wave, kBorder, inner, LineOf(image, grating.wave.down));
      };
      const std::complex<double> kept = share(blurred) / share(sharp);
      EXPECT_NEAR(kept.real(), Disk(blur, grating.wave.period), 0.01)
          << NameOf(way.algorithm) << ": " << blur << " px of blur, period " << grating.wave.period;
      EXPECT_NEAR(kept.imag(), 0.0, 0.01) << NameOf(way.algorithm) << ": " << blur << ' ' << grating.wave.period;
      worst = std::max(worst, std::abs(kept.real() - Disk(blur, grating.wave.period)));
      quadrature = std::max(quadrature, std::abs(kept.imag()));
    }
    std::printf("%s: in phase within %.4f, quadrature within %.4f\n", std::string(NameOf(way.algorithm)).c_str(), worst,
                quadrature);
  }
}

/// Blur that changes by up to 0.02 px a pixel, over pieces of whole periods.
TEST(Subpixel, GratingsKeepWhatPhysicsSaysWhereBlurChanges) {
  std::mt19937 random(21);
  for (const Algorithm algorithm : {Algorithm::Gather, Algorithm::Plane, Algorithm::Auto}) {
    double worst = 0.0, quadrature = 0.0;
    for (int i = 0; i < 60; ++i) {
      Grating grating = GratingOf(random, i % 2 == 1);
      const double slope = std::uniform_real_distribution(-0.02, 0.02)(random);
      const double middle = std::uniform_real_distribution(-4.0, 4.0)(random);
      const OpticalState state = Blurred(grating.scene, middle, 1.0);
      const double px_per_d = state.aperture_diameter_m * state.sensor_distance_m / 5e-6;
      const double tilt = -0.5 * kLength * slope / px_per_d;
      grating.scene.surfaces[0].shape = grating.wave.down ? PlaneShape{1.0, 0.0, tilt} : PlaneShape{1.0, tilt, 0.0};
      const LightImage image = Render(grating.scene, state, {.algorithm = algorithm});
      const auto line = LineOf(image, grating.wave.down);
      const double sharp = grating.wave.PixelMean(0, 0) == 0.5
                               ? 1.0
                               : (grating.wave.PixelMean(0, 0) - 0.5) / (grating.wave.At(0.5, 0.5) - 0.5);
      const auto expected = [&](int at) {
        const double x = at + 0.5, blur = middle + slope * (x - 0.5 * kLength);
        return 0.5 + Disk(blur, grating.wave.period) * sharp * (grating.wave.At(x, x) - 0.5);
      };
      // Pieces of 24 px, or rather of the whole periods nearest to it that are whole pixels.
      const int pieces = std::gcd(grating.repeats, 5 * 4 * 3) >= 4 ? 4 : std::gcd(grating.repeats, 3) == 3 ? 3 : 1;
      const int length = (kLength - 2 * kBorder) / pieces;
      if (grating.repeats % pieces != 0) continue;
      for (int piece = 0; piece < pieces; ++piece) {
        const int from = kBorder + piece * length;
        const double focused = sharp * grating.wave.amplitude;
        const std::complex<double> off =
            (ShareOf(grating.wave, from, length, line) - ShareOf(grating.wave, from, length, expected)) / focused;
        EXPECT_NEAR(off.real(), 0.0, 0.01) << NameOf(algorithm) << ' ' << middle << ' ' << grating.wave.period;
        EXPECT_NEAR(off.imag(), 0.0, 0.01) << NameOf(algorithm) << ' ' << middle << ' ' << grating.wave.period;
        worst = std::max(worst, std::abs(off.real()));
        quadrature = std::max(quadrature, std::abs(off.imag()));
      }
    }
    std::printf("%s: in phase within %.4f, quadrature within %.4f\n", std::string(NameOf(algorithm)).c_str(), worst,
                quadrature);
  }
}

TEST(Subpixel, FocusedFramesAreTheirTexture) {
  Scene scene = EmptyScene(60, 20);
  const TexturePaint noise = WhiteNoise(60, 20, 1);
  scene.surfaces.push_back(Wall(1.0, noise));
  for (const Way& way : kWays) {
    const LightImage image = Render(scene, Blurred(scene, 0.0, 1.0),
                                    {.algorithm = way.algorithm, .rays_per_pixel = std::max(34, way.rays / 10)});
    for (std::size_t i = 0; i < image.light.size(); ++i) {
      ASSERT_NEAR(image.light[i], noise.texture->light[i], 0.5f / 255.0f) << NameOf(way.algorithm);
    }
  }
}

TEST(Subpixel, StepsHardlyOvershootAndNothingIsBelowBlack) {
  Scene step = EmptyScene(60, 8);
  step.surfaces.push_back(Wall(1.0, TextureOf(60, 8, [](int x, int) { return x < 30 ? 0.2 : 0.8; })));
  Scene points = EmptyScene(40, 40);
  points.surfaces.push_back(
      Wall(1.0, TextureOf(40, 40, [](int x, int y) { return x % 9 == 4 && y % 9 == 4 ? 1.0 : 0.0; })));
  for (const Way& way : kWays) {
    for (double blur = 0.0; blur <= 9.0; blur += way.rays > 0 ? 1.3 : 0.11) {
      const RenderOptions options{.algorithm = way.algorithm, .rays_per_pixel = std::max(1, way.rays)};
      for (const float light : Render(step, Blurred(step, blur, 1.0), options).light) {
        ASSERT_GE(light, 0.2f - 0.025f * 0.6f) << NameOf(way.algorithm) << ' ' << blur;
        ASSERT_LE(light, 0.8f + 0.025f * 0.6f) << NameOf(way.algorithm) << ' ' << blur;
      }
      for (const float light : Render(points, Blurred(points, blur, 1.0), options).light)
        ASSERT_GE(light, 0.0f) << blur;
    }
  }
}

/// One thing a ray may meet: a wave on a wall of that vergence, between two columns of the picture.
struct Strip {
  double vergence_d;
  double left;
  double right;
  Wave wave;
};

/// The mean over a pixel and the whole aperture, by rays spread evenly over all four dimensions. Nearest strip first.
double RayMean(const std::vector<Strip>& strips, const OpticalState& state, double pixel_m, int x, int y) {
  constexpr int kRays = 8192;
  constexpr double kSteps[] = {0.8566748838545029, 0.7338918566271259, 0.6287067210378087, 0.5385972572236101};
  double sum = 0.0;
  for (int i = 0; i < kRays; ++i) {
    std::array<double, 4> at;
    for (std::size_t k = 0; k < 4; ++k) at[k] = std::fmod(0.5 + (i + 1) * kSteps[k], 1.0);
    const double radius = 0.5 * state.aperture_diameter_m * std::sqrt(at[0]);
    const double hx = radius * std::cos(kTurn * at[1]), hy = radius * std::sin(kTurn * at[1]);
    for (const Strip& strip : strips) {
      const double image_m = 1.0 / (1.0 / state.focal_length_m - strip.vergence_d);
      const double spread = (1.0 - state.sensor_distance_m / image_m) / pixel_m;  // px a metre of height
      const double px = x + at[2] - hx * spread, py = y + at[3] - hy * spread;
      if (px < strip.left || px >= strip.right) continue;
      sum += strip.wave.At(px, py) / kRays;
      break;
    }
  }
  return sum;
}

struct Errors {
  std::vector<double> inside, edge;  ///< levels of 255

  static double Mean(const std::vector<double>& errors) {
    double sum = 0.0;
    for (const double error : errors) sum += error;
    return sum / static_cast<double>(errors.size());
  }
  static double Percentile99(std::vector<double> errors) {
    std::ranges::sort(errors);
    return errors[static_cast<std::size_t>(0.99 * static_cast<double>(errors.size() - 1))];
  }
};

/// A wave behind, a wave in front between two columns of pixels, with the near one at `focus` and more blur behind.
void CompareWithRays(std::mt19937& random, bool depth_map, Algorithm algorithm, Errors& errors) {
  constexpr int kWidth = 96, kHeight = 20, kLeft = 40, kRight = 70;
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto wave = [&] {
    return Wave{uniform(3.0, 16.0), uniform(0.0, kTurn), uniform(0.0, 1.0) < 0.5, uniform(0.1, 0.4)};
  };
  const std::vector<Strip> strips = {{uniform(1.0, 1.08), kLeft, kRight, wave()},
                                     {uniform(0.92, 1.0), -1e9, 1e9, wave()}};
  Scene scene = EmptyScene(kWidth, kHeight);
  if (depth_map) {
    auto map = std::make_shared<DepthMap>(DepthMap{kWidth, kHeight, {}});
    const auto strip_at = [&](int x) -> const Strip& { return strips[x >= kLeft && x < kRight ? 0 : 1]; };
    for (int i = 0; i < kWidth * kHeight; ++i)
      map->depth_m.push_back(static_cast<float>(1.0 / strip_at(i % kWidth).vergence_d));
    TexturePaint paint = TextureOf(kWidth, kHeight, [&](int x, int y) { return strip_at(x).wave.PixelMean(x, y); });
    paint.stretched = true;
    scene.surfaces.push_back({DepthMapShape{map}, {}, paint});
  } else {
    scene.surfaces.push_back(Wall(strips[1].vergence_d, TextureOf(kWidth, kHeight, strips[1].wave)));
    scene.surfaces.push_back(
        Wall(strips[0].vergence_d, TextureOf(kWidth, kHeight, strips[0].wave),
             {static_cast<double>(kLeft) / kWidth, 0.0, static_cast<double>(kRight - kLeft) / kWidth, 1.0}));
  }
  const OpticalState state = Blurred(scene, 0.0, uniform(0.92, 1.08));
  const double near = std::abs(SignedBlurPx(scene.camera, state, strips[0].vergence_d));
  const double far = std::abs(SignedBlurPx(scene.camera, state, strips[1].vergence_d));
  const LightImage image = Render(scene, state, {.algorithm = algorithm});
  for (int i = 0; i < 60; ++i) {
    const int x = std::uniform_int_distribution(0, kWidth - 1)(random), y = kHeight / 2 - 2 + i % 5;
    const double truth = RayMean(strips, state, 5e-6, x, y);
    const double away = std::min(std::abs(x + 0.5 - kLeft), std::abs(x + 0.5 - kRight));
    const bool edge = away < 0.5 * std::max(near, far) + 4.0;
    // The picture's borders show mirrored texture, and so do rows near the top of what goes down.
    const double border = std::min({x + 0.5, kWidth - x - 0.5, y + 0.5, kHeight - y - 0.5});
    if (border < 0.5 * std::max(near, far) + 4.0) continue;
    const double error =
        255.0 * std::abs(static_cast<double>(image.light[static_cast<std::size_t>(y * kWidth + x)]) - truth);
    (edge ? errors.edge : errors.inside).push_back(error);
  }
}

TEST(Subpixel, LayersAndDepthMapsAgreeWithRaysThroughWhatTheyStandFor) {
  std::mt19937 random(22);
  const long cases = lensd::testing::ByLevel(10, 16, 40);
  for (const auto& [name, depth_map, algorithm] : {std::tuple("layers", false, Algorithm::Layers),
                                                   {"layers, auto", false, Algorithm::Auto},
                                                   {"depth maps, auto", true, Algorithm::Auto}}) {
    Errors errors;
    for (long i = 0; i < cases; ++i) CompareWithRays(random, depth_map, algorithm, errors);
    std::printf("%s: mean %.3f, 99 %% %.3f of 255 at %zu points; edge zone %.3f and %.3f at %zu\n", name,
                Errors::Mean(errors.inside), Errors::Percentile99(errors.inside), errors.inside.size(),
                Errors::Mean(errors.edge), Errors::Percentile99(errors.edge), errors.edge.size());
    EXPECT_LE(Errors::Mean(errors.inside), 0.1) << name;
    EXPECT_LE(Errors::Percentile99(errors.inside), 1.0) << name;
  }
}

}  // namespace
}  // namespace lensd::sim
