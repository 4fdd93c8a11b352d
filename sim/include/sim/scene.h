// A simulated scene: what stands before the camera, the lens and its mechanics, the sensor, and what goes wrong when.
// Plain data; field names are the keys of the scene file (docs: scenes/README.md), with the unit as suffix.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/result.h"
#include "drivers/api/lens.h"

namespace lensd::sim {

/// A rectangle as fractions of the frame: x and y of its upper left corner, width, height; all in [0, 1].
struct Region {
  double x = 0.0;
  double y = 0.0;
  double w = 1.0;
  double h = 1.0;
};

/// Linear light, row-major, 1 is white (0.9 of full well at the initial f-number).
struct Texture {
  int width = 0;                               ///< px
  int height = 0;                              ///< px
  std::vector<float> light;                    ///< luminance, width * height values in [0, 1]
  std::array<std::vector<float>, 3> colour{};  ///< red, green and blue alike; empty: grey
};

/// Axial depths from the lens centre, row-major; unknown samples have been given the farthest known depth.
struct DepthMap {
  int width = 0;               ///< px
  int height = 0;              ///< px
  std::vector<float> depth_m;  ///< width * height values, > 0
};

/// A picture on a surface, its samples the means over their pixels, mirrored to fill it: image pixel centre (i + 0.5, j
/// + 0.5) of the frame shows the texture at texture_px_per_image_px times that, in texture pixels. A depth map's
/// texture is stretched to the frame instead.
struct TexturePaint {
  std::shared_ptr<const Texture> texture;
  double texture_px_per_image_px = 1.0;
  bool stretched = false;
};
/// What pixels show: 0.5 + 0.5 cos(2 pi x / period_x_px) cos(2 pi y / period_y_px) at their middles, x and y in image
/// pixels from the frame's upper left corner; a factor whose period is 0 is 1.
struct SinusoidPaint {
  double period_x_px = 0.0;
  double period_y_px = 0.0;
};
/// The same light everywhere.
struct ConstantPaint {
  double light = 0.5;
};
/// A straight ramp from the frame's left edge to its right edge.
struct GradientPaint {
  double left = 0.0;
  double right = 1.0;
};
using Paint = std::variant<TexturePaint, SinusoidPaint, ConstantPaint, GradientPaint>;

/// Vergence u0 + ux x + uy y in dioptres, x and y in [-1, 1] across the frame. A wall is a plane with ux = uy = 0.
struct PlaneShape {
  double u0_d = 0.0;
  double ux_d = 0.0;
  double uy_d = 0.0;
};
/// Measured depth, stretched to the frame.
struct DepthMapShape {
  std::shared_ptr<const DepthMap> depth;
};

/// Something to look at. Where several cover a pixel the nearest wins; light outside every surface is 0.
struct Surface {
  std::variant<PlaneShape, DepthMapShape> shape;
  Region region;
  Paint paint;
  double sway_m = 0.0;   ///< a wall alone in its scene: its distance goes up and down by so much ...
  double sway_s = 10.0;  ///< ... once in this time, receding at first
};

/// A point of light; x and y are fractions of the frame.
struct LightPoint {
  double x = 0.5;
  double y = 0.5;
  double distance_m = 1.0;  ///< may be infinite
  double intensity = 1.0;   ///< times full scale of one pixel when sharp, at the initial f-number
};

/// What is wrong with a sensor for good: the same pixels in every frame.
struct SensorFlaws {
  double prnu = 0.0;        ///< standard deviation of the pixels' gains (EMVA 1288, photo response non-uniformity)
  double hot_pixels = 0.0;  ///< share of the pixels whose dark current fills 0.1 to 1 of the well in exposure_ms
  int dirt = 0;             ///< specks on the cover glass
  double dirt_px = 12.0;    ///< diameter of the largest shadow; the others down to 0.3 of that
  double dirt_loss = 0.3;   ///< light lost in the middle of the darkest shadow; in the others down to 0.3 of that
  std::uint64_t seed = 1;   ///< which pixels, and where the dirt lies

  bool any() const { return prnu > 0.0 || hot_pixels > 0.0 || dirt > 0; }
};

/// What a camera makes of its samples before it gives them away.
struct Finish {
  double tone = 0.0;        ///< from the straight line, 0, to 3 x^2 - 2 x^3, 1; after gamma
  double sharpening = 0.0;  ///< times what a sample is above the 3 x 3 binomial mean around it
  int jpeg_quality = 0;     ///< 1 to 100; 0: no JPEG

  bool any() const { return tone > 0.0 || sharpening > 0.0 || jpeg_quality > 0; }
};

struct CameraSettings {
  int width = 640;   ///< px
  int height = 480;  ///< px
  double pixel_um = 3.45;
  int bits = 8;                       ///< 8, 10, 12 or 16
  bool colour = false;                ///< red, green and blue at every pixel, each a sensor of its own
  std::optional<double> full_well_e;  ///< none: no photon noise
  double read_noise_e = 0.0;          ///< standard deviation; needs full_well_e
  double black_level = 0.0;           ///< fraction of full scale added before quantisation
  double exposure_ms = 10.0;
  double frame_rate_hz = 60.0;
  double flicker = 0.0;  ///< relative amplitude at 100 Hz
  double gamma = 1.0;
  double shake_px = 0.0;  ///< standard deviation of the picture's sideways displacement from frame to frame
  double veil = 0.0;      ///< share of the light that glare spreads evenly over the frame
  SensorFlaws flaws{};
  Finish finish{};
};

enum class LensModel { Pinhole, Aperture, Thin };

struct LensSettings {
  LensModel model = LensModel::Thin;
  /// The power changes and the sensor stays, at the focal length given; extension is that minus the focal length now.
  bool liquid = false;
  double min_focal_length_mm = 25.0;  ///< equal to the maximum unless the lens zooms
  double max_focal_length_mm = 25.0;
  /// How far the lens centre moves toward the scene from the shortest focal length to the longest, evenly in focal
  /// length. Distances of the scene start where it is at the shortest.
  double centre_shift_mm = 0.0;
  double min_f_number = 1.4;
  double max_f_number = 16.0;
  double min_extension_mm = 0.0;
  double max_extension_mm = 1.6;
  int steps = 8192;  ///< focus positions 0 .. steps - 1 over the extension range
  double speed_steps_per_s = 8000.0;
  double acceleration_steps_per_s2 = 200000.0;
  double settle_ms = 8.0;
  double ring_hz = 0.0;
  double ring_damping = 0.02;
  drivers::Feedback feedback = drivers::Feedback::Counts;  ///< what the positions of its axes are
  bool reference = true;  ///< its axes have one, and can search it
  double backlash_steps = 0.0;
  int iris_steps = 100;  ///< iris positions 0 .. iris_steps - 1, even in log(f-number)
  double iris_backlash_steps = 0.0;
  /// Relative change of focal length, and with it of the picture's size, from the minimum extension to the maximum. The
  /// focal lengths above are those at extension 0, and so is the one in the f-number: the opening does not breathe.
  double breathing = 0.0;
  int aperture_blades = 0;  ///< 0: a circle; else the corners of the polygon of the same area, at least 3
  double temperature_c = 20.0;
  double drift_um_per_c = 0.0;  ///< extension gained per degree above 20 C
  double initial_f_number = 2.0;
  double vignetting = 0.0;  ///< share of the light that the frame's corners lose to the fourth power of the cosine

  double obstruction = 0.0;  ///< diameter of what hides the middle of the opening, over the opening's
  /// How far off, in widest openings, a second rim as large as the widest opening is seen from the frame's corners.
  double cats_eye = 0.0;
  /// Seidel's spherical aberration W040 and coma W131 in micrometres of path at the widest opening's rim, the coma for
  /// the frame's corners (render/pupil.h). Positive: rays through the rim come together nearer to the lens.
  double spherical_um = 0.0;
  double coma_um = 0.0;
  double field_curvature_um = 0.0;          ///< extension that the frame's corners need more than its middle
  std::array<double, 2> sensor_tilt_um{};   ///< the same for half a diagonal to the right, and downward
  std::array<double, 2> colour_focus_um{};  ///< extension that red and blue need more than green
  double focus_shift_um = 0.0;              ///< extension that the widest opening needs more than a very small one
  std::vector<double> filter_focus_um{};  ///< extension that each place of its filter wheel needs more; empty: no wheel
  bool telecentric = true;                ///< the picture keeps its size; else it grows with 1 + extension/focal length
  bool thermometer = true;                ///< the lens tells its temperature

  bool zooms() const { return max_focal_length_mm > min_focal_length_mm; }
};

enum class FaultKind {
  Stall,             ///< the axis stands still while it is counted on; it complains of "stalled"
  Jump,              ///< the mechanism is knocked `steps` away from where the count says
  Disconnect,        ///< every call fails with Disconnected
  Reconnect,         ///< ends a disconnect
  DropReply,         ///< calls fail with Timeout, though commands have been obeyed
  LateReply,         ///< a call fails with Timeout and its answer arrives as the answer to the next one
  StaleReadback,     ///< reads repeat what was true when the fault began
  FreezeFrames,      ///< the camera repeats its last picture under new time stamps
  LoseFrames,        ///< exposed frames never arrive
  WrongExposure,     ///< exposures last `factor` times what was asked, unreported
  MissedSteps,       ///< the mechanism loses `factor` of every move, which is counted all the same
  Warmth,            ///< the lens is `by_c` warmer than the scene says
  WrongTemperature,  ///< its thermometer reads `by_c` too high
};

/// As scene files name them: "stall", "drop-reply"; none: no such kind.
std::optional<FaultKind> FaultKindFromName(std::string_view name);
/// All of them, for people.
std::string FaultKindNames();

/// One thing that goes wrong, on the simulated clock (0: when the world was made).
struct Fault {
  double at_ms = 0.0;
  FaultKind kind = FaultKind::Stall;
  drivers::Axis axis = drivers::Axis::Focus;
  double for_ms = 0.0;   ///< 0: from then on
  double steps = 100.0;  ///< of a jump, native units
  double factor = 0.5;   ///< of a wrong exposure, or the part of each move that missed-steps loses
  double by_c = 5.0;     ///< of warmth and of a wrong temperature, degrees
};

/// A picture that the camera gives as it is, instead of one rendered and exposed.
struct PreparedFrame {
  std::shared_ptr<const std::vector<std::uint16_t>> luminance;
  std::shared_ptr<const std::vector<std::uint16_t>> colour;  ///< red, green, blue; null: a camera without
};

/// Everything a scene file says.
struct Scene {
  CameraSettings camera;
  LensSettings lens;
  std::vector<Surface> surfaces;
  std::vector<LightPoint> lights;
  std::vector<Fault> faults;
  std::vector<PreparedFrame> frames;  ///< played in turn, over and over; empty: frames are rendered
  Region truth_region{0.4, 0.4, 0.2, 0.2};
};

/// The scene as it is from a lens centre so far ahead: every depth is that much less. Pictures of surfaces stay where
/// they are in the frame, as they were laid; a tilted plane stays a plane.
Scene SeenFrom(const Scene& scene, double ahead_m);

/// How far the vergence of the scene's one moving wall is from where it stood at time 0; 0 where nothing moves.
double SwayD(const Scene& scene, double seconds);

/// Reads a scene file with its textures and depth maps. Paths in it are relative to it. Errors: Code::BadData
/// ("file:line: what is wrong") for an unknown key, a wrong value or a damaged picture; Code::Io where a file cannot be
/// read.
Result<Scene> LoadScene(const std::string& path);

}  // namespace lensd::sim
