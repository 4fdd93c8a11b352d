// The contract suite on a simulated device in a driver process.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "odd_device.h"
#include "stand.h"

namespace lensd {
namespace {

class SimInProcess final : public contract::RealStand {
 public:
  SimInProcess() {
    std::string name = (std::filesystem::temp_directory_path() / "lensd-process-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
    folder_ = name;
    std::ofstream(folder_ + "/scene.toml") << R"(version = 1
[camera]
width = 64
height = 48
bits = 10
frame_rate_hz = 200
exposure_ms = 1
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 8192
speed_steps_per_s = 40000
[[surface]]
kind = "wall"
distance_m = 1.0
sinusoid_px = [8.0, 0.0]
)";
  }
  ~SimInProcess() override { std::filesystem::remove_all(folder_); }

  Result<drivers::Device> Open() override {
    const auto settings = io::ParseToml("scene = \"" + folder_ + "/scene.toml\"", "bench.toml");
    if (!settings) return PassOn(settings);
    return drivers::process::OpenInProcess({.command = {LENSD_BINARY_DIR "/bin/lensd-driver", "sim"}, .driver = "sim"},
                                           *settings, clock());
  }

 private:
  std::string folder_;
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(SimInProcess, LensContract, contract::Stands<SimInProcess>());
INSTANTIATE_TEST_SUITE_P(SimInProcess, CameraContract, contract::Stands<SimInProcess>());

}  // namespace lensd
