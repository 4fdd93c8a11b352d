// From a scene and the state of a lens to the light on the sensor: linear, without noise (sensor.h adds what a sensor
// does). Everything is in image pixels: a surface is given where its chief rays (through the lens centre) meet the
// sensor, so that a scene point keeps its place in the picture while its blur disk grows around it.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "sim/scene.h"

namespace lensd::sim {

/// What the lens does to light now. Lengths in metres, finite, > 0 (aperture diameter: >= 0).
struct OpticalState {
  LensModel model = LensModel::Thin;
  double focal_length_m = 0.025;      ///< used by Thin alone
  double aperture_diameter_m = 0.01;  ///< used by Aperture and Thin; Pinhole is its limit at 0
  double sensor_distance_m = 0.025;   ///< lens centre to sensor
  double magnification = 1.0;         ///< size of the picture, about the frame's middle, over what the scene says
  double centre_shift_m = 0.0;        ///< how far the lens centre is ahead: for Pictures, which look from there
};

/// A rectangle of whole pixels.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

/// Linear light, row-major; 1 is white at the initial f-number. How the aperture scales light is left to the sensor.
struct LightImage {
  int width = 0;             ///< px
  int height = 0;            ///< px
  std::vector<float> light;  ///< width * height values, >= 0 (a gradient's ramp may leave [0, 1] beyond the frame)
};

/// How a picture is made. `Auto` takes the first of those below whose error bound for this scene and state of the lens
/// is within tolerance. An explicit choice is refused where it cannot render the scene at all, whatever its error.
enum class Algorithm {
  Auto,
  Fourier,  ///< one wall with a formula (sinusoid, ramp, one colour), in closed form
  Wall,     ///< one textured wall: one disk for all pixels
  Gather,   ///< each pixel averages its own disk; right on one surface whose blur changes slowly, ignores occlusion
  Pupil,    ///< one textured wall through a lens that is not perfect: kernels of rays, one for each part of the frame
  Plane,    ///< one textured tilted plane: each pixel sums the light of its own ellipse
  Layers,   ///< walls blurred one by one and laid over each other; not exact where two blurred things meet
  Hybrid,   ///< layers, with rays where those are not exact
  March,    ///< walls and depth maps: rays of neighbouring pixels followed in step
  Splat,    ///< forward projection, one surface: each scene point spreads over its disk. Slow; Auto never takes it
  Rays,     ///< reverse projection: rays through the aperture, one by one, with visibility. Slow; the truth
};

/// The algorithm's name in lower case, as the bench prints it.
std::string_view NameOf(Algorithm algorithm);

struct RenderOptions {
  double tolerance = 0.5 / 255.0;     ///< largest error Auto may accept, of full scale; 1 asks for the fastest
  std::optional<PixelRect> region{};  ///< only this part of the frame; none: all of it
  Algorithm algorithm = Algorithm::Auto;
  int rays_per_pixel = 65536;  ///< Hybrid, March, Rays: at most (Auto), exactly or a little more (asked for by name)
  std::stop_token stop{};      ///< from any thread: ends slow work at its next pixel, row or tile, with Cancelled
};

struct Rendered {
  LightImage image;                       ///< of the region asked for
  PixelRect region;                       ///< which part of the frame it is
  Algorithm algorithm = Algorithm::Auto;  ///< the one used
  double error_bound =
      0.0;  ///< of full scale, against converged rays; of light as fine as the pixels see ShortPeriodError()
};

/// A scene made ready for rendering: textures laid on the sensor's grid once. Const calls may come from any thread.
class Renderer {
 public:
  /// InvalidArgument: the scene has no pixels, or an aperture of one or two blades.
  static Result<Renderer> Create(const Scene& scene);
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// The light on the sensor. InvalidArgument: a length of `state` is not finite or not above 0, or the region is empty
  /// or leaves the frame. Unsupported: the algorithm asked for cannot render this scene. Cancelled: options.stop came.
  Result<Rendered> Render(const OpticalState& state, const RenderOptions& options = {}) const;

  /// Of full scale: what one pixel in a thousand of a picture of all the frame may be off by beyond `error_bound` where
  /// light changes from pixel to pixel, since kernels on a grid do not have a disk's transform exactly. Not of rays nor
  /// formulas. The state must be one that Render() takes. Takes as long as looking at every pixel of every surface.
  double ShortPeriodError(const OpticalState& state) const;

 private:
  struct Prepared;
  explicit Renderer(std::unique_ptr<const Prepared> prepared);
  std::unique_ptr<const Prepared> prepared_;
};

/// The blur disk of a scene point of that vergence (1/m; 0: infinitely far) as a signed diameter in pixels of
/// scene.camera: positive behind the focal plane (farther), negative in front. From rays alone, see blur_line.h.
double SignedBlurPx(const CameraSettings& camera, const OpticalState& state, double vergence_d);

}  // namespace lensd::sim
