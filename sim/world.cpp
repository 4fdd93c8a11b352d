// One lens and camera before one scene on a clock given from outside. Every call works out where things are at that
// instant.
#include "sim/world.h"

#include <string>
#include <utility>

#include "sim/bench.h"
#include "sim/camera/sim_camera.h"
#include "sim/mechanics/mechanics.h"
#include "sim/scene/subjects.h"
#include "sim/sim_lens.h"

namespace lensd::sim {
namespace {

class WorldTruth final : public Truth {
 public:
  explicit WorldTruth(std::shared_ptr<Mechanics> mechanics)
      : mechanics_(std::move(mechanics)), subjects_(SubjectsIn(mechanics_->scene())) {}

  const std::vector<SubjectDepth>& subjects() const override { return subjects_; }
  TrueState Now() const override { return mechanics_->StateAt(mechanics_->Now()); }

 private:
  const std::shared_ptr<Mechanics> mechanics_;
  const std::vector<SubjectDepth> subjects_;
};

/// What a data sheet would tell; nothing of a hole without a lens, which cannot be focused.
std::optional<drivers::NominalOptics> NominalOf(const LensSettings& lens) {
  if (lens.model != LensModel::Thin) return std::nullopt;
  drivers::NominalOptics optics;
  optics.focal_length_m = lens.min_focal_length_mm * 1e-3;
  if (lens.zooms()) optics.max_focal_length_m = lens.max_focal_length_mm * 1e-3;
  optics.centre_shift_m = 1e-3 * lens.centre_shift_mm;
  optics.min_f_number = lens.min_f_number;
  optics.max_f_number = lens.max_f_number;
  optics.min_extension_m = lens.min_extension_mm * 1e-3;
  optics.max_extension_m = lens.max_extension_mm * 1e-3;
  optics.liquid = lens.liquid;
  return optics;
}

/// Of 640x480 that is 52: enough to see a place again. A simulated lens that is watched for days holds no more.
constexpr std::size_t kOwnPicturesBytes = std::size_t{32} << 20;

}  // namespace

Result<World> OpenWorld(std::shared_ptr<const Scene> scene, const Clock& clock, const WorldOptions& options) {
  const double start = options.focus_start.value_or(Native{0.0}).value;
  if (!(start >= 0.0 && start <= scene->lens.steps - 1.0)) {
    return Fail(Code::InvalidArgument, "the lens cannot start at step " + std::to_string(start) + ": its range is 0.." +
                                           std::to_string(scene->lens.steps - 1));
  }
  auto pictures = options.pictures;
  if (!pictures) {
    auto own = Pictures::Create(scene, kOwnPicturesBytes);
    if (!own) return PassOn(own);
    pictures = std::move(*own);
  }
  const auto optics = NominalOf(scene->lens);
  auto mechanics = std::make_shared<Mechanics>(std::move(scene), clock, start);
  World world;
  world.device.lens = std::make_unique<SimLens>(mechanics);
  auto camera = std::make_unique<SimCamera>(mechanics, pictures, options.seed, options.aside);
  world.device.simulation = std::make_shared<Bench>(mechanics, std::move(pictures), camera->exposure());
  world.device.camera = std::move(camera);
  world.device.optics = optics;
  world.truth = std::make_shared<WorldTruth>(std::move(mechanics));
  return world;
}

}  // namespace lensd::sim
