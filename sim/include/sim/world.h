// One simulated lens and camera before one scene, on whatever clock it is given: nothing happens in between calls,
// every call works out where things are at that instant. The same code runs in real time behind the daemon and
// thousands of times faster on a stepped clock. Equal scenes, seeds and calls at equal times give equal frames, bit for
// bit.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/device.h"
#include "sim/pictures.h"
#include "sim/scene.h"

namespace lensd::sim {

struct WorldOptions {
  std::uint64_t seed = 1;                ///< of the noise
  std::optional<Native> focus_start{};   ///< count, homed and come to rest there; none: 0
  std::shared_ptr<Pictures> pictures{};  ///< of the same scene, to share; none: its own
  /// Frames are made on a thread of the camera's own, and Poll() never waits for one: for clocks that run by
  /// themselves.
  bool aside = false;
};

/// How things really are: for scoring only. Neither Lens nor Camera tells.
struct TrueState {
  double focus_steps = 0.0;  ///< where the mechanism is, as the count that means this place when moving outward
  std::optional<double> iris_steps{};  ///< the same; none: no iris that moves
  std::optional<double> zoom_mm{};     ///< the same; none: it does not zoom
  std::optional<double> filter{};      ///< the same; none: no filter wheel
  OpticalState optics;
  double extension_m = 0.0;
  double f_number = 0.0;
  double focal_plane_d = 0.0;  ///< vergence of the plane in focus, from the lens centre, where the truth
                               ///< region has its middle; negative past infinity
  double sway_d = 0.0;         ///< how far the subject's vergence is from where it was at time 0, where it moves
};

/// One subject in the region of truth.
struct SubjectDepth {
  double vergence_d = 0.0;  ///< median over its pixels
  double share = 0.0;       ///< of the region's pixels
};

/// Reads the truth of one world; keeps it alive. From any thread.
class Truth {
 public:
  virtual ~Truth() = default;
  /// What can be focused on in the scene's truth region, the largest share first. Rule: the vergences of the nearest
  /// surface at each pixel, sorted, are cut where neighbours differ by more than one pixel of blur at the widest
  /// opening; each piece of at least 5 % of the region is a subject and its best focus is its median. Where no piece is
  /// that large, the whole region is one subject. As at time 0: TrueState::sway_d is to be added.
  virtual const std::vector<SubjectDepth>& subjects() const = 0;
  virtual TrueState Now() const = 0;
};

/// Half a depth of field at that state: the vergence step that costs two pixels of blur, 2 px N/(f Z_s).
double HalfDepthOfFieldD(const CameraSettings& camera, const TrueState& state);

struct World {
  drivers::Device device;
  std::shared_ptr<const Truth> truth;
};

/// Makes a world; its time 0 is now. InvalidArgument: a start outside the focus axis. The clock must outlive the device
/// and the truth. The lens stands homed; the camera looks at the truth region by default.
Result<World> OpenWorld(std::shared_ptr<const Scene> scene, const Clock& clock, const WorldOptions& options = {});

}  // namespace lensd::sim
