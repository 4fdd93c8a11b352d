// Sixteen lenses of eight kinds. Their mechanics go on while no lensd runs; each opening by lensd is another handle to
// them, whose closing stops what moves. What goes wrong with one is written down, for those who judge.
#include "true_lenses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

namespace lensd::year {
namespace {

using drivers::Axis;

struct Kind {
  const char* scene;   ///< keys of [lens]
  const char* config;  ///< keys of [lens.focus]
};
constexpr std::array<Kind, 8> kKinds = {{
    {"feedback = \"encoder\"\niris_steps = 100\n", ""},
    {"feedback = \"counts\"\niris_steps = 100\n", ""},
    {"feedback = \"counts\"\nbacklash_steps = 9\niris_steps = 100\niris_backlash_steps = 2\n", ""},
    {"feedback = \"encoder\"\nbacklash_steps = 9\n", "park = 0\n"},
    {"feedback = \"echo\"\n", ""},
    {"feedback = \"counts\"\nbacklash_steps = 4\n", "restore = \"conditional\"\n"},
    // No feedback, and no word of how long it takes to gain speed: that is for settle_ms to cover.
    // Nothing tells when it is there: how long that takes is for the configuration to say.
    {"feedback = \"none\"\niris_steps = 100\n", "settle_ms = 40\n[lens.iris]\nspeed = 396\nsettle_ms = 40\n"},
    {"feedback = \"counts\"\n", "restore = \"near-zero\"\npark = 100\n"},
}};
constexpr const char* kScene = R"(version = 1
[camera]
width = 48
height = 32
pixel_um = 3.45
exposure_ms = 2
frame_rate_hz = 100
[[surface]]
kind = "wall"
distance_m = 1.2
sinusoid_px = [8.0, 0.0]
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 4001
speed_steps_per_s = 2000
acceleration_steps_per_s2 = 100000
settle_ms = 5
initial_f_number = 2.0
)";

/// A handle to a lens that stays: what one lensd has of it.
class Handle final : public drivers::Lens {
 public:
  Handle(drivers::Capabilities capabilities, TrueLens& lens, const Planted& planted)
      : Lens(std::move(capabilities)), lens_(lens), planted_(planted), number_(++lens.opened) {}
  ~Handle() override {
    if (number_ != lens_.opened) return;
    for (const Axis axis : drivers::kAxes) {
      if (capabilities().axes[axis]) (void)real().Stop(axis);
    }
  }

 private:
  drivers::Lens& real() const { return *lens_.world.device.lens; }
  Result<void> DoStartHome(Axis axis) override {
    const auto begun = real().StartHome(axis);
    if (begun && machine::Now() > lens_.troubled_until) lens_.doubtful_until[axis] = 0;
    if (lens_.frozen_until[axis] > machine::Now()) lens_.doubtful_until[axis] = machine::kNever;
    return begun;
  }
  Result<void> DoStartMove(Axis axis, Native target) override { return real().StartMove(axis, target); }
  Result<drivers::LensState> DoRead() override {
    if (const std::int64_t hang = std::exchange(lens_.hang, 0); hang > 0) machine::Sleep(hang);
    return real().Read();
  }
  Result<void> DoStop(Axis axis) override { return planted_.stop_ignored ? Result<void>() : real().Stop(axis); }

  TrueLens& lens_;
  const Planted& planted_;
  const std::uint64_t number_;
};

class Eye final : public drivers::Camera {
 public:
  explicit Eye(drivers::Camera& camera) : Camera(camera.capabilities()), camera_(camera) {}

 private:
  Result<void> DoStart() override { return camera_.Start(); }
  Result<void> DoStop() override { return camera_.Stop(); }
  Result<std::optional<drivers::Frame>> DoPoll() override { return camera_.Poll(); }
  Result<void> DoSetExposure(Duration exposure) override { return camera_.SetExposure(exposure); }
  Result<void> DoSetGain(double gain) override { return camera_.SetGain(gain); }
  Result<drivers::ExposureState> DoReadExposure() override { return camera_.ReadExposure(); }
  drivers::Counters DoCount() const override { return camera_.counters(); }

  drivers::Camera& camera_;
};

}  // namespace

std::string LensName(std::uint64_t number) {
  return std::string("l") + (number < 10 ? "0" : "") + std::to_string(number);
}

std::optional<double> TrueLens::PlaceAt(Axis axis, std::int64_t at) const {
  const auto truth = world.device.simulation->TruthAt(Instant(Duration(at)), std::nullopt);
  if (!truth || !truth->positions[axis]) return std::nullopt;
  return truth->positions[axis]->value;
}

bool TrueLens::MovesNow(Axis axis) const {
  const auto now = PlaceAt(axis, machine::Now());
  const auto before = PlaceAt(axis, machine::Now() - 1'000'000);
  return now && before && std::abs(*now - *before) > 0.5;
}

Lenses::Lenses(const Clock& clock, const Planted& planted) : clock_(clock), planted_(planted) {
  std::array<std::shared_ptr<const sim::Scene>, kKinds.size()> scenes;
  std::array<std::shared_ptr<sim::Pictures>, kKinds.size()> pictures;
  std::ofstream config("lensd.toml");
  config << "version = 1\n[access]\nmove = [\"users\"]\nadminister = [\"adm\"]\n";
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind) {
    const std::string file = "scene-" + std::to_string(kind) + ".toml";
    std::ofstream(file) << kScene << kKinds[kind].scene;
    auto scene = sim::LoadScene(file);
    if (!scene) machine::Found(scene.error().message);
    scenes[kind] = std::make_shared<const sim::Scene>(*std::move(scene));
    pictures[kind] = *sim::Pictures::Create(scenes[kind]);
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::size_t kind = i % kKinds.size();
    auto lens = std::make_unique<TrueLens>();
    lens->name = LensName(i);
    sim::WorldOptions options;
    options.seed = i + 1;
    options.pictures = pictures[kind];
    auto world = sim::OpenWorld(scenes[kind], clock, options);
    if (!world) machine::Found(world.error().message);
    lens->world = *std::move(world);
    config << "[[lens]]\nname = \"" << lens->name << "\"\ndriver = \"sim\"\nscene = \"scene-" << kind << ".toml\"\n";
    if (*kKinds[kind].config != '\0') config << "[lens.focus]\n" << kKinds[kind].config;
    lenses_.emplace(lens->name, std::move(lens));
  }
}

drivers::Device Lenses::Open(const std::string& name) {
  TrueLens& lens = *lenses_.at(name);
  drivers::Capabilities capabilities = lens.world.device.lens->capabilities();
  if (planted_.backlash_hidden) {
    for (const Axis axis : drivers::kAxes) {
      if (capabilities.axes[axis]) capabilities.axes[axis]->backlash = 0.0;
    }
  }
  drivers::Device device;
  device.lens = std::make_unique<Handle>(std::move(capabilities), lens, planted_);
  device.camera = std::make_unique<Eye>(*lens.world.device.camera);
  device.optics = lens.world.device.optics;
  device.simulation = lens.world.device.simulation;
  return device;
}

std::string Lenses::Trouble(Chance& chance) {
  static constexpr std::array kFaults = {"stall",      "missed-steps", "disconnect",     "drop-reply",
                                         "late-reply", "jump",         "stale-readback", "disconnect"};
  TrueLens& lens = *std::next(lenses_.begin(), static_cast<std::ptrdiff_t>(chance.Below(lenses_.size())))->second;
  if (chance.OneIn(40)) {
    lens.hang = static_cast<std::int64_t>(chance.Between(1.0, 40.0) * 1e9);
    lens.troubled_until = std::max(lens.troubled_until, machine::Now() + lens.hang + 60 * machine::kSecond);
    return lens.name + " hangs for " + std::to_string(lens.hang);
  }
  drivers::SimulatedFault fault;
  fault.kind = kFaults[chance.Below(kFaults.size())];
  const bool iris = lens.PlaceAt(Axis::Iris, machine::Now()).has_value() && chance.OneIn(4);
  fault.axis = iris ? Axis::Iris : Axis::Focus;
  const bool at_once = fault.kind == "jump";
  const auto ns = static_cast<std::int64_t>(1e9 * std::exp(chance.Between(-3.0, 3.0)));
  if (!at_once) fault.lasts = Duration(ns);
  if (at_once) fault.steps = std::round(chance.Between(-60.0, 60.0));
  const std::int64_t until = machine::Now() + (at_once ? 0 : ns) + 1'000'000;
  lens.troubled_until = std::max(lens.troubled_until, until);
  const auto& can = lens.world.device.lens->capabilities().axes[*fault.axis];
  const bool loses = at_once || fault.kind == "missed-steps";
  // A device that only repeats its target shows no stall that is over before its complaint counts.
  const bool unseen =
      can->follows() ? loses && can->feedback != drivers::Feedback::Encoder : loses || fault.kind == "stall";
  if (fault.kind == "stale-readback") lens.frozen_until[*fault.axis] = until;
  if (unseen) lens.doubtful_until[*fault.axis] = machine::kNever;
  if (auto injected = lens.world.device.simulation->Inject(fault); !injected) machine::Found(injected.error().message);
  return lens.name + " " + fault.kind + " " + std::to_string(ns);
}

}  // namespace lensd::year
