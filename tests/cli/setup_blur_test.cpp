// The blur of a step that setup states, for lenses and scenes drawn at random: simulated pictures of textures and of
// stripes, and the truth worked out here from what the lens was made as.
#include "cli/online/setup/setup_blur.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>

#include "sim/render.h"
#include "sim/scene.h"
#include "test_level.h"

namespace lensd::cli {
namespace {

/// One lens with a camera before one wall.
struct SetupScene {
  sim::Scene scene;
  double f_number = 2.8;
  double distance_m = 1.2;
  double light_change = 0.0;  ///< relative, from picture to picture: the largest
  double focus_error = 0.0;   ///< of what counts as in focus, steps
  std::uint64_t seed = 1;

  double StepMm() const { return (scene.lens.max_extension_mm - scene.lens.min_extension_mm) / (scene.lens.steps - 1); }
  double FocalMm() const { return scene.lens.min_focal_length_mm; }
  /// What brings the wall into focus.
  double ExtensionMm() const { return FocalMm() * FocalMm() / (1e3 * distance_m - FocalMm()); }
  double FocusStep() const { return (ExtensionMm() - scene.lens.min_extension_mm) / StepMm(); }
  /// The opening's diameter over the image distance: by it a disk grows with every mm.
  double PxPerStep() const {
    return StepMm() * (FocalMm() / f_number) / (FocalMm() + ExtensionMm()) / (1e-3 * scene.camera.pixel_um);
  }
};

/// A camera of 128 x 128 px or more, with photon noise, rounding and a lamp that changes.
class DrawnPictures : public FocusPictures {
 public:
  explicit DrawnPictures(const SetupScene& drawn)
      : drawn_(drawn), renderer_(sim::Renderer::Create(drawn.scene).value()), random_(drawn.seed) {}

  std::expected<double, Failure> Go(double position) override {
    EXPECT_GE(position, 0.0);
    EXPECT_LE(position, drawn_.scene.lens.steps - 1);
    position_ = std::round(position);
    return position_;
  }

  std::expected<LightPicture, Failure> Look() override {
    ++pictures;
    sim::OpticalState state;
    state.focal_length_m = 1e-3 * drawn_.FocalMm();
    state.aperture_diameter_m = state.focal_length_m / drawn_.f_number;
    state.sensor_distance_m =
        state.focal_length_m + 1e-3 * (drawn_.scene.lens.min_extension_mm + position_ * drawn_.StepMm());
    const sim::LightImage image = renderer_.Render(state).value().image;
    const sim::CameraSettings& camera = drawn_.scene.camera;
    const double full = std::pow(2.0, camera.bits) - 1.0, well = *camera.full_well_e;
    const double lamp = 1.0 + drawn_.light_change * std::uniform_real_distribution(-1.0, 1.0)(random_);
    LightPicture picture{image.width, image.height, {}};
    for (const float light : image.light) {
      const double electrons = 0.9 * lamp * light * well;
      const double seen = electrons + noise_(random_) * std::sqrt(std::max(electrons, 0.0) + 9.0);
      const double level = std::clamp(std::round((seen / well + camera.black_level) * full), 0.0, full);
      picture.light.push_back(level / full);
    }
    return picture;
  }

  int pictures = 0;

 private:
  const SetupScene& drawn_;
  sim::Renderer renderer_;
  std::mt19937_64 random_;
  std::normal_distribution<double> noise_;
  double position_ = 0.0;
};

sim::Paint Textured(const char* file) {
  // A scene file that shows the texture reads it.
  const std::string path = ::testing::TempDir() + "setup-blur-scene.toml";
  std::FILE* const out = std::fopen(path.c_str(), "w");
  std::fprintf(out, "version = 1\n[[surface]]\nkind = \"wall\"\ndistance_m = 1\ntexture = \"%s/scenes/%s\"\n",
               LENSD_SOURCE_DIR, file);
  std::fclose(out);
  return sim::LoadScene(path).value().surfaces.front().paint;
}

class SetupBlur : public ::testing::Test {
 protected:
  double Between(double low, double high) { return low + (high - low) * uniform_(random_); }
  double LogBetween(double low, double high) { return low * std::pow(high / low, uniform_(random_)); }
  bool One(int in) { return random_() % static_cast<unsigned>(in) == 0; }

  /// A lens that reaches from infinity to half the distance of its wall.
  SetupScene Drawn(const sim::Paint& paint) {
    SetupScene drawn;
    drawn.seed = random_();
    drawn.f_number = LogBetween(1.4, 11.0);
    sim::LensSettings& lens = drawn.scene.lens;
    lens.min_focal_length_mm = lens.max_focal_length_mm = LogBetween(8.0, 75.0);
    drawn.distance_m = 1e-3 * lens.min_focal_length_mm * LogBetween(20.0, 100.0);
    lens.min_extension_mm = 0.0;
    lens.max_extension_mm = drawn.ExtensionMm() * Between(1.5, 3.0);
    sim::CameraSettings& camera = drawn.scene.camera;
    camera.pixel_um = LogBetween(1.4, 6.0);
    camera.width = camera.height = 128 + static_cast<int>(Between(0.0, 60.0));
    const int bits[] = {8, 10, 12};
    camera.bits = bits[random_() % 3];
    camera.full_well_e = LogBetween(4e3, 4e4);
    if (One(2)) camera.black_level = Between(0.0, 0.06);
    if (One(3)) drawn.light_change = LogBetween(0.001, 0.03);
    // As many steps as make the blur of one 0.005 to 1 px.
    lens.steps = 2;
    lens.steps = 2 + static_cast<int>(std::min(drawn.PxPerStep() / LogBetween(0.005, 1.0), 6e4));
    drawn.focus_error = Between(-0.5, 0.5) / drawn.PxPerStep();
    drawn.scene.surfaces.push_back(
        {.shape = sim::PlaneShape{.u0_d = 1.0 / drawn.distance_m}, .region = {}, .paint = paint});
    return drawn;
  }

  struct Score {
    int lenses = 0, stated = 0, within = 0;
    double widest = 0.0;
  };
  void Judge(const SetupScene& drawn, Score& score) {
    DrawnPictures pictures(drawn);
    const double last = drawn.scene.lens.steps - 1;
    const double focus = std::round(drawn.FocusStep() + drawn.focus_error);
    ASSERT_TRUE(pictures.Go(focus));
    const auto found = MeasureBlurSlope(pictures, {std::ceil(0.1 * last), std::floor(0.9 * last), 1.0}, focus);
    ASSERT_TRUE(found);
    ++score.lenses;
    const auto& seen = found->px_per_step;
    EXPECT_EQ(seen.has_value(), found->why_not.empty());
    if (!seen) {
      why_[found->why_not.substr(0, 40)]++;
      return;
    }
    ++score.stated;
    const double truth = drawn.PxPerStep();
    const bool within = seen->low <= truth && truth <= seen->high;
    score.within += within;
    score.widest = std::max(score.widest, (seen->high - seen->low) / truth);
    if (within) return;
    std::printf(
        "false: %.5f (%.5f to %.5f) px a step by %d pictures, in truth %.5f; f/%.2f, light %.4f, %d bit, black %.3f\n",
        seen->value, seen->low, seen->high, found->pictures, truth, drawn.f_number, drawn.light_change,
        drawn.scene.camera.bits, drawn.scene.camera.black_level);
  }
  void Print(const char* what, const Score& score) {
    std::printf("%s: of %d lenses stated %d, within their interval %d, widest %.3f\n", what, score.lenses, score.stated,
                score.within, score.widest);
    for (const auto& [why, times] : why_) std::printf("  %d times: %s\n", times, why.c_str());
    why_.clear();
  }

  std::mt19937_64 random_{20261128};
  std::uniform_real_distribution<double> uniform_;
  std::map<std::string, int> why_;
};

TEST_F(SetupBlur, OfTheWallOfTheExamples) {
  Score score;
  for (long i = 0; i < testing::ByLevel(1, 1, 20); ++i) {
    SetupScene drawn{.scene = sim::LoadScene(LENSD_SOURCE_DIR "/systemd/examples/wall.toml").value()};
    drawn.scene.camera.width = 256;
    drawn.scene.camera.height = 192;
    drawn.seed = random_();
    drawn.focus_error = std::round(Between(-10.0, 10.0));
    Judge(drawn, score);
  }
  Print("wall.toml", score);
  EXPECT_EQ(score.stated, score.lenses);
  EXPECT_EQ(score.within, score.lenses);
  EXPECT_LT(score.widest, 0.45);  // what leaves it open by more than a fifth on either side is refused
}

TEST_F(SetupBlur, OfStripesIsStatedTrulyOrNotAtAll) {
  Score score;
  for (long i = 0; i < testing::ByLevel(1, 3, 150); ++i) {
    sim::SinusoidPaint stripes{.period_x_px = LogBetween(5.0, 60.0)};
    if (One(3)) stripes.period_y_px = LogBetween(5.0, 60.0);
    if (One(3)) std::swap(stripes.period_x_px, stripes.period_y_px);
    Judge(Drawn(stripes), score);
  }
  Print("stripes", score);
  EXPECT_GE(score.within, score.stated - score.lenses / 100);
  EXPECT_GE(score.stated, score.lenses / 2);
}

TEST_F(SetupBlur, OfTexturesIsStatedTruly) {
  const sim::Paint paints[] = {Textured("score/ground.png"), Textured("textures/brick.png")};
  Score score;
  for (long i = 0; i < testing::ByLevel(1, 3, 150); ++i) Judge(Drawn(paints[i % 2]), score);
  Print("textures", score);
  EXPECT_GE(score.within, score.stated - score.lenses / 100);
  EXPECT_GE(score.stated, score.lenses * 3 / 4);
}

}  // namespace
}  // namespace lensd::cli
