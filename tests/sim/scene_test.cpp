// Scene files: defaults, every key, and a refusal with its line for everything that is wrong.
#include "sim/scene.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "io/png.h"

namespace lensd::sim {
namespace {

class SceneFile : public ::testing::Test {
 protected:
  SceneFile() {
    std::filesystem::create_directories(folder_);
    // One pixel of each: white, pure green.
    const io::Image colours{2, 1, 3, 8, {255, 255, 255, 0, 255, 0}};
    EXPECT_TRUE(io::WritePng(Path("colours.png"), colours));
    EXPECT_TRUE(io::WritePng(Path("depth.png"), io::Image{3, 1, 1, 16, {0, 2500, 4000}}));
    EXPECT_TRUE(io::WritePng(Path("unknown.png"), io::Image{2, 1, 1, 16, {0, 0}}));
  }
  ~SceneFile() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  Result<Scene> Load(const std::string& text) const {
    std::ofstream(Path("scene.toml")) << text;
    return LoadScene(Path("scene.toml"));
  }

  /// What is wrong, without the folder: "scene.toml:LINE: ...".
  std::string ErrorOf(const std::string& text) const {
    const auto scene = Load(text);
    if (scene) return "no error";
    EXPECT_EQ(scene.error().code, Code::BadData);
    const std::string folder = folder_.string() + "/";
    std::string message = scene.error().message;
    for (auto at = message.find(folder); at != std::string::npos; at = message.find(folder)) {
      message.erase(at, folder.size());
    }
    return message;
  }

 private:
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("lensd-scene-" + std::to_string(::getpid()));
};

constexpr const char* kWall = "[[surface]]\nkind = \"wall\"\ndistance_m = 2\nconstant = 0.5\n";

TEST_F(SceneFile, FillsInDefaults) {
  const auto scene = Load(std::string("version = 1\n") + kWall);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_EQ(scene->camera.width, 640);
  EXPECT_EQ(scene->camera.height, 480);
  EXPECT_FALSE(scene->camera.full_well_e.has_value());
  EXPECT_EQ(scene->lens.model, LensModel::Thin);
  EXPECT_EQ(scene->lens.steps, 8192);
  EXPECT_EQ(scene->lens.initial_f_number, 2.0);
  EXPECT_EQ(scene->truth_region.x, 0.4);
  ASSERT_EQ(scene->surfaces.size(), 1u);
  EXPECT_EQ(std::get<PlaneShape>(scene->surfaces[0].shape).u0_d, 0.5);
  EXPECT_EQ(std::get<ConstantPaint>(scene->surfaces[0].paint).light, 0.5);
}

TEST_F(SceneFile, ReadsEveryKey) {
  const auto scene = Load(R"(
version = 1
[camera]
width = 320
height = 240
pixel_um = 5
bits = 12
full_well_e = 20000
read_noise_e = 2
black_level = 0.01
exposure_ms = 4
frame_rate_hz = 100
flicker = 0.1
gamma = 2.2
veil = 0.06
prnu = 0.01
hot_pixels = 1e-4
dirt = 20
dirt_px = 9
dirt_loss = 0.5
flaw_seed = 7
tone = 0.4
sharpening = 1.5
[lens]
model = "aperture"
focal_length_mm = [10, 40.5]
f_number = [2, 22]
extension_mm = [-0.25, 3]
steps = 1000
speed_steps_per_s = 500
acceleration_steps_per_s2 = 1000
settle_ms = 3
ring_hz = 45
ring_damping = 0.1
backlash_steps = 12
iris_steps = 50
iris_backlash_steps = 2
breathing = 0.01
aperture_blades = 6
temperature_c = 35
drift_um_per_c = 0.5
initial_f_number = 4
vignetting = 0.3
[[surface]]
kind = "plane"
vergence_d = [0.8, 0.3, 0]
texture = "colours.png"
texture_px_per_image_px = 0.5
region = [0, 0, 0.5, 1]
[[surface]]
kind = "depth-map"
file = "depth.png"
sinusoid_px = [8, 0]
[[surface]]
kind = "wall"
distance_m = inf
gradient = [0.1, 0.9]
[[light]]
x = 0.25
distance_m = 3
intensity = 50
[[fault]]
at_ms = 500
kind = "missed-steps"
axis = "iris"
for_ms = 200
factor = 0.25
[truth]
region = [0.1, 0.2, 0.3, 0.4]
)");
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  const CameraSettings& camera = scene->camera;
  EXPECT_EQ(camera.width, 320);
  EXPECT_EQ(camera.height, 240);
  EXPECT_EQ(camera.pixel_um, 5.0);
  EXPECT_EQ(camera.bits, 12);
  EXPECT_EQ(camera.full_well_e, 20000.0);
  EXPECT_EQ(camera.read_noise_e, 2.0);
  EXPECT_EQ(camera.black_level, 0.01);
  EXPECT_EQ(camera.exposure_ms, 4.0);
  EXPECT_EQ(camera.frame_rate_hz, 100.0);
  EXPECT_EQ(camera.flicker, 0.1);
  EXPECT_EQ(camera.gamma, 2.2);
  EXPECT_EQ(camera.veil, 0.06);
  EXPECT_EQ(camera.flaws.prnu, 0.01);
  EXPECT_EQ(camera.flaws.hot_pixels, 1e-4);
  EXPECT_EQ(camera.flaws.dirt, 20);
  EXPECT_EQ(camera.flaws.dirt_px, 9.0);
  EXPECT_EQ(camera.flaws.dirt_loss, 0.5);
  EXPECT_EQ(camera.flaws.seed, 7u);
  EXPECT_EQ(camera.finish.tone, 0.4);
  EXPECT_EQ(camera.finish.sharpening, 1.5);
  const LensSettings& lens = scene->lens;
  EXPECT_EQ(lens.model, LensModel::Aperture);
  EXPECT_EQ(lens.min_focal_length_mm, 10.0);
  EXPECT_EQ(lens.max_focal_length_mm, 40.5);
  EXPECT_TRUE(lens.zooms());
  EXPECT_EQ(lens.min_f_number, 2.0);
  EXPECT_EQ(lens.max_f_number, 22.0);
  EXPECT_EQ(lens.min_extension_mm, -0.25);
  EXPECT_EQ(lens.max_extension_mm, 3.0);
  EXPECT_EQ(lens.steps, 1000);
  EXPECT_EQ(lens.speed_steps_per_s, 500.0);
  EXPECT_EQ(lens.acceleration_steps_per_s2, 1000.0);
  EXPECT_EQ(lens.settle_ms, 3.0);
  EXPECT_EQ(lens.ring_hz, 45.0);
  EXPECT_EQ(lens.ring_damping, 0.1);
  EXPECT_EQ(lens.backlash_steps, 12.0);
  EXPECT_EQ(lens.iris_steps, 50);
  EXPECT_EQ(lens.iris_backlash_steps, 2.0);
  EXPECT_EQ(lens.breathing, 0.01);
  EXPECT_EQ(lens.aperture_blades, 6);
  EXPECT_EQ(lens.temperature_c, 35.0);
  EXPECT_EQ(lens.drift_um_per_c, 0.5);
  EXPECT_EQ(lens.initial_f_number, 4.0);
  EXPECT_EQ(lens.vignetting, 0.3);
  ASSERT_EQ(scene->surfaces.size(), 3u);
  const auto& paint = std::get<TexturePaint>(scene->surfaces[0].paint);
  EXPECT_EQ(paint.texture_px_per_image_px, 0.5);
  EXPECT_FALSE(paint.stretched);
  EXPECT_EQ(scene->surfaces[0].region.w, 0.5);
  EXPECT_EQ(std::get<SinusoidPaint>(scene->surfaces[1].paint).period_x_px, 8.0);
  EXPECT_EQ(std::get<PlaneShape>(scene->surfaces[2].shape).u0_d, 0.0);
  EXPECT_EQ(std::get<GradientPaint>(scene->surfaces[2].paint).right, 0.9);
  ASSERT_EQ(scene->lights.size(), 1u);
  EXPECT_EQ(scene->lights[0].intensity, 50.0);
  ASSERT_EQ(scene->faults.size(), 1u);
  EXPECT_EQ(scene->faults[0].kind, FaultKind::MissedSteps);
  EXPECT_EQ(scene->faults[0].axis, drivers::Axis::Iris);
  EXPECT_EQ(scene->faults[0].factor, 0.25);
  EXPECT_EQ(scene->truth_region.h, 0.4);
}

TEST_F(SceneFile, ReadsWhatIsWrongWithALens) {
  const std::string keys =
      "[lens]\nobstruction = 0.3\ncats_eye = 0.2\nspherical_um = -1.5\ncoma_um = 0.5\nfield_curvature_um = 30\n"
      "sensor_tilt_um = [5, -6]\ncolour_focus_um = [10, -12]\ntelecentric = false\n";
  const auto scene = Load("version = 1\n" + keys + kWall);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  const LensSettings& lens = scene->lens;
  EXPECT_EQ(lens.obstruction, 0.3);
  EXPECT_EQ(lens.cats_eye, 0.2);
  EXPECT_EQ(lens.spherical_um, -1.5);
  EXPECT_EQ(lens.coma_um, 0.5);
  EXPECT_EQ(lens.field_curvature_um, 30.0);
  EXPECT_EQ(lens.sensor_tilt_um, (std::array{5.0, -6.0}));
  EXPECT_EQ(lens.colour_focus_um, (std::array{10.0, -12.0}));
  EXPECT_FALSE(lens.telecentric);
  const std::string wall = kWall;
  EXPECT_EQ(ErrorOf("version = 1\n[lens]\nmodel = \"aperture\"\ncoma_um = 1\n" + wall),
            "scene.toml:4: [lens] coma_um is for a thin lens");
  EXPECT_EQ(ErrorOf("version = 1\n[lens]\nobstruction = 1\n" + wall),
            "scene.toml:3: [lens] obstruction must be from 0 to 0.9, not 1");
}

TEST_F(SceneFile, TakesLuminanceAndTheFarthestKnownDepth) {
  const auto scene =
      Load("version = 1\n[[surface]]\nkind = \"depth-map\"\nfile = \"depth.png\"\ntexture = \"colours.png\"\n");
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  const auto& depth = std::get<DepthMapShape>(scene->surfaces[0].shape).depth->depth_m;
  EXPECT_EQ(depth, (std::vector<float>{4.0f, 2.5f, 4.0f}));
  const auto& paint = std::get<TexturePaint>(scene->surfaces[0].paint);
  EXPECT_TRUE(paint.stretched);
  EXPECT_FLOAT_EQ(paint.texture->light[0], 1.0f);
  EXPECT_FLOAT_EQ(paint.texture->light[1], 0.7152f);
}

TEST_F(SceneFile, EveryFaultKindHasItsName) {
  const std::pair<const char*, FaultKind> kinds[] = {
      {"stall", FaultKind::Stall},
      {"jump", FaultKind::Jump},
      {"disconnect", FaultKind::Disconnect},
      {"reconnect", FaultKind::Reconnect},
      {"drop-reply", FaultKind::DropReply},
      {"late-reply", FaultKind::LateReply},
      {"stale-readback", FaultKind::StaleReadback},
      {"freeze-frames", FaultKind::FreezeFrames},
      {"lose-frames", FaultKind::LoseFrames},
      {"wrong-exposure", FaultKind::WrongExposure},
      {"missed-steps", FaultKind::MissedSteps},
      {"warmth", FaultKind::Warmth},
      {"wrong-temperature", FaultKind::WrongTemperature},
  };
  for (const auto& [name, kind] : kinds) {
    const auto scene = Load(std::string("version = 1\n") + kWall + "[[fault]]\nat_ms = 1\nkind = \"" + name + "\"\n");
    ASSERT_TRUE(scene.has_value()) << name << ": " << scene.error().message;
    EXPECT_EQ(scene->faults[0].kind, kind) << name;
  }
}

TEST_F(SceneFile, NamesTheLineOfWhatIsWrong) {
  const std::string wall = kWall;
  const std::pair<std::string, std::string> cases[] = {
      {"version = 2\n" + wall, "scene.toml:1: the scene version must be 1"},
      {wall, "scene.toml:1: the scene version is missing: write version = ..."},
      {"version = 1\ncolour = 3\n" + wall, "scene.toml:2: unknown key \"colour\" in the scene"},
      {"version = 1\n[camera]\nwidht = 640\n" + wall,
       "scene.toml:3: unknown key \"widht\" in [camera]; did you mean \"width\"?"},
      {"version = 1\n[camera]\nbits = 9\n" + wall, "scene.toml:3: [camera] bits must be 8, 10, 12 or 16"},
      {"version = 1\n[camera]\nwidth = 2.5\n" + wall, "scene.toml:3: [camera] width must be a whole number, not 2.5"},
      {"version = 1\n[camera]\nread_noise_e = 3\n" + wall,
       "scene.toml:3: [camera] read_noise_e needs full_well_e: without a full well, electrons cannot be turned into "
       "light"},
      {"version = 1\n[camera]\nwidth = 32768\nheight = 32768\n" + wall,
       "scene.toml:4: [camera] height makes a frame of more than 2^26 pixels"},
      {"version = 1\n[camera]\nbits = 12\njpeg_quality = 80\n" + wall,
       "scene.toml:4: [camera] jpeg_quality is for cameras of 8 bits without colour"},
      {"version = 1\n[camera]\nhot_pixels = 0.5\n" + wall,
       "scene.toml:3: [camera] hot_pixels must be from 0 to 0.1, not 0.5"},
      {"version = 1\n[lens]\nvignetting = 1\n" + wall, "scene.toml:3: [lens] vignetting must be from 0 to 0.99, not 1"},
      {"version = 1\n[lens]\nmodel = \"thick\"\n" + wall,
       "scene.toml:3: [lens] model must be one of pinhole, aperture, thin, not \"thick\""},
      {"version = 1\n[lens]\nf_number = [16, 2]\n" + wall,
       "scene.toml:3: [lens] f_number must be written from low to high"},
      {"version = 1\n[lens]\nextension_mm = 1.5\n" + wall,
       "scene.toml:3: [lens] extension_mm must be a range [low, high]"},
      {"version = 1\n[lens]\ninitial_f_number = 1.0\n" + wall,
       "scene.toml:3: [lens] initial_f_number must be from 1.4 to 16, not 1"},
      {"version = 1\n[[surface]]\nkind = \"wall\"\nconstant = 0.5\n",
       "scene.toml:2: [[surface]] distance_m is missing: write distance_m = ..."},
      {"version = 1\n[[surface]]\nkind = \"wall\"\ndistance_m = -2\nconstant = 0.5\n",
       "scene.toml:4: [[surface]] distance_m must be from 0.001 to 1e+09, not -2"},
      {"version = 1\n[[surface]]\nkind = \"wall\"\ndistance_m = 2\n",
       "scene.toml:2: [[surface]] needs exactly one of texture, sinusoid_px, constant and gradient"},
      {"version = 1\n" + wall + "sinusoid_px = [8, 0]\n",
       "scene.toml:2: [[surface]] needs exactly one of texture, sinusoid_px, constant and gradient"},
      {"version = 1\n[[surface]]\nkind = \"wall\"\ndistance_m = 2\ntexture = \"missing.png\"\n",
       "scene.toml:5: [[surface]] texture cannot be used: missing.png: No such file or directory"},
      {"version = 1\n[[surface]]\nkind = \"wall\"\nvergence_d = [1, 0, 0]\ndistance_m = 2\nconstant = 0.5\n",
       "scene.toml:4: unknown key \"vergence_d\" in [[surface]]"},
      {"version = 1\n[[surface]]\nkind = \"plane\"\nvergence_d = [0.2, 0.3, 0]\nconstant = 0.5\n",
       "scene.toml:4: [[surface]] vergence_d must stay between 0 and 1000 dioptres over the region"},
      {"version = 1\n[[surface]]\nkind = \"depth-map\"\nfile = \"colours.png\"\nconstant = 0.5\n",
       "scene.toml:4: [[surface]] file cannot be used: colours.png: a depth map is a 16-bit grey PNG in millimetres"},
      {"version = 1\n[[surface]]\nkind = \"depth-map\"\nfile = \"unknown.png\"\nconstant = 0.5\n",
       "scene.toml:4: [[surface]] file cannot be used: unknown.png: every depth is unknown (0)"},
      {"version = 1\n" + wall + "region = [0.5, 0, 0.6, 1]\n",
       "scene.toml:6: [[surface]] region must be x, y, w, h as fractions of the frame, not empty and inside it"},
      {"version = 1\n" + wall + "[[fault]]\nat_ms = 1\nkind = \"explode\"\n",
       "scene.toml:8: [[fault]] kind must be one of stall, jump, disconnect, reconnect, drop-reply, late-reply, "
       "stale-readback, freeze-frames, lose-frames, wrong-exposure, missed-steps, warmth, wrong-temperature, not "
       "\"explode\""},
      {"version = 1\n" + wall + "[[fault]]\nkind = \"stall\"\n",
       "scene.toml:6: [[fault]] at_ms is missing: write at_ms = ..."},
      {"version = 1\n", "scene.toml:1: the scene needs a [[surface]] or a [[light]] to look at"},
  };
  for (const auto& [text, expected] : cases) EXPECT_EQ(ErrorOf(text), expected) << text;
}

TEST(Scene, SaysWhenTheFileIsNotThere) {
  const auto scene = LoadScene("/nonexistent/scene.toml");
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, Code::Io);
}

}  // namespace
}  // namespace lensd::sim
