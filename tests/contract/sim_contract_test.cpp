// The contract suites on the simulated lens and camera.
#include "sim/world.h"
#include "stand.h"

namespace lensd::sim {
namespace {

constexpr auto kUnpluggedAt = std::chrono::minutes(10);
constexpr auto kPluggedAt = std::chrono::minutes(20);

class SimStand final : public contract::SteppedStand {
 public:
  Result<drivers::Device> Open() override {
    auto world = OpenWorld(std::make_shared<const Scene>(SceneFromHere()), clock_, {});
    if (!world) return PassOn(world);
    // An open simulated device that is unplugged says so when it is first asked, as any.
    if (unplugged_) {
      if (auto read = world->device.lens->Read(); !read) return PassOn(read);
    }
    return std::move(world->device);
  }
  bool Unplug() override {
    unplugged_ = true;
    clock_.AdvanceTo(Instant{kUnpluggedAt});
    return true;
  }
  void Plug() override {
    unplugged_ = false;
    clock_.AdvanceTo(Instant{kPluggedAt});
  }

 private:
  /// A small zoom lens before a wall. Its faults are dated from when the world is made.
  Scene SceneFromHere() const {
    Scene scene;
    scene.camera.width = 32;
    scene.camera.height = 24;
    scene.lens.max_focal_length_mm = 50.0;
    scene.surfaces.push_back({PlaneShape{1.0, 0.0, 0.0}, {}, ConstantPaint{0.5}});
    const auto ms = [&](auto at) {
      return std::chrono::duration<double, std::milli>(Instant{at} - clock_.Now()).count();
    };
    if (unplugged_) {
      scene.faults.push_back({.at_ms = 0.0, .kind = FaultKind::Disconnect});
    } else if (ms(kUnpluggedAt) > 0.0) {
      scene.faults.push_back({.at_ms = ms(kUnpluggedAt), .kind = FaultKind::Disconnect});
    }
    return scene;
  }

  bool unplugged_ = false;
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Sim, LensContract, contract::Stands<SimStand>());
INSTANTIATE_TEST_SUITE_P(Sim, CameraContract, contract::Stands<SimStand>());

}  // namespace lensd::sim
