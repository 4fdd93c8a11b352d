// The simulated camera as drivers/api sees it: frames by the grid, made at once on a stepped clock and by the darkroom
// on the machine's.
#include "sim/camera/sim_camera.h"

#include <cmath>
#include <string>
#include <utility>

namespace lensd::sim {
namespace {

constexpr Duration kShortestExposure = std::chrono::microseconds(1);
constexpr Duration kLongestExposure = std::chrono::seconds(100);
constexpr double kHighestGainDb = 24.0;
constexpr Duration kLongestWork = std::chrono::seconds(10);  // on one frame

drivers::CameraCapabilities CapabilitiesOf(const Scene& scene, bool aside) {
  drivers::CameraCapabilities capabilities;
  capabilities.driver = "sim";
  capabilities.model = "simulated camera";
  capabilities.width = scene.camera.width;
  capabilities.height = scene.camera.height;
  capabilities.bits = scene.camera.bits;
  capabilities.colour = scene.camera.colour;
  // Prepared frames take no work.
  capabilities.on_demand = aside && scene.frames.empty();
  capabilities.pixel_um = scene.camera.pixel_um;
  capabilities.frame_rate_hz = scene.camera.frame_rate_hz;
  capabilities.can_set_exposure = true;
  capabilities.shortest_exposure = kShortestExposure;
  capabilities.longest_exposure = kLongestExposure;
  capabilities.gain = {0.0, kHighestGainDb, drivers::GainUnit::Decibels};
  const Region& region = scene.truth_region;
  capabilities.focus_region = {region.x, region.y, region.w, region.h};
  return capabilities;
}

}  // namespace

SimCamera::SimCamera(std::shared_ptr<Mechanics> mechanics, std::shared_ptr<Pictures> pictures, std::uint64_t seed,
                     bool aside)
    : Camera(CapabilitiesOf(mechanics->scene(), aside)),
      mechanics_(std::move(mechanics)),
      exposure_(std::make_shared<std::atomic<Duration>>(
          Duration(std::llround(mechanics_->scene().camera.exposure_ms * 1e6)))),
      maker_(mechanics_, std::move(pictures), Sensor::Real, seed),
      grid_(mechanics_->scene().camera.frame_rate_hz, exposure_->load()) {
  if (capabilities().on_demand) darkroom_.emplace(maker_);
}

Result<void> SimCamera::CheckLink() const {
  if (!mechanics_->Disconnected()) return {};
  return Fail(Code::Disconnected, "the simulated camera is disconnected by a [[fault]] of its scene");
}

Result<void> SimCamera::DoStart() {
  if (auto link = CheckLink(); !link) return link;
  grid_.Start(mechanics_->Now());
  return {};
}

Result<void> SimCamera::DoStop() {
  if (auto link = CheckLink(); !link) return link;
  grid_.Stop(mechanics_->Now());
  if (darkroom_) darkroom_->Cancel();
  return {};
}

Result<void> SimCamera::DoSetExposure(Duration exposure) {
  if (auto link = CheckLink(); !link) return link;
  if (exposure < kShortestExposure || exposure > kLongestExposure) {
    return Fail(Code::OutOfRange, "the simulated camera exposes from 1 us to 100 s");
  }
  grid_.SetExposure(mechanics_->Now(), exposure);
  *exposure_ = exposure;
  return {};
}

Result<void> SimCamera::DoSetGain(double gain_db) {
  if (auto link = CheckLink(); !link) return link;
  gain_ = {gain_.now_db, gain_db, mechanics_->Now()};
  return {};
}

Result<drivers::ExposureState> SimCamera::DoReadExposure() {
  if (auto link = CheckLink(); !link) return PassOn(link);
  return drivers::ExposureState{grid_.exposure(), gain_.now_db};
}

std::optional<Exposure> SimCamera::Newest() {
  auto exposure = grid_.NewestDone(mechanics_->Now());
  const auto counted = std::exchange(next_uncounted_, exposure ? exposure->sequence + 1 : next_uncounted_);
  while (exposure && exposure->sequence >= next_sequence_) {
    if (!mechanics_->FaultAt(FaultKind::LoseFrames, exposure->start)) return exposure;
    if (exposure->sequence >= counted) ++counts_.frames_lost;
    if (exposure->sequence == 0) return std::nullopt;
    exposure = grid_.Numbered(exposure->sequence - 1);
  }
  return std::nullopt;
}

Result<std::optional<drivers::Frame>> SimCamera::DoPoll() {
  if (auto link = CheckLink(); !link) return PassOn(link);
  if (!grid_.streaming()) return Fail(Code::InvalidArgument, "the camera is not streaming: start it first");
  if (darkroom_ && darkroom_->busy()) return Developed();
  const auto exposure = Newest();
  if (!exposure) return std::optional<drivers::Frame>();
  next_sequence_ = exposure->sequence + 1;
  const bool frozen = mechanics_->FaultAt(FaultKind::FreezeFrames, exposure->start).has_value();
  if (frozen && last_samples_.luminance) return FrameOf(*exposure, last_samples_);
  Shot shot = maker_.ShotOf(*exposure);
  shot.amplification = std::pow(10.0, (exposure->start < gain_.changed ? gain_.before_db : gain_.now_db) / 20.0);
  if (darkroom_) {
    darkroom_->Submit(std::move(shot));
    submitted_ = mechanics_->Now();
    return std::optional<drivers::Frame>();
  }
  auto samples = maker_.Make(shot, {});
  if (!samples) return PassOn(samples);
  return FrameOf(*exposure, *std::move(samples));
}

Result<std::optional<drivers::Frame>> SimCamera::Developed() {
  if (auto done = darkroom_->Take()) {
    if (!done->samples) return PassOn(done->samples);
    return FrameOf(done->exposure, *std::move(done->samples));
  }
  if (mechanics_->Now() - submitted_ < kLongestWork) return std::optional<drivers::Frame>();
  darkroom_->Cancel();
  return Fail(Code::Timeout,
              "rendering a frame of this scene takes more than 10 s: make the frame smaller, the aperture round or the "
              "scene simpler");
}

drivers::Frame SimCamera::FrameOf(const Exposure& exposure, Samples samples) {
  last_samples_ = samples;
  ++counts_.frames;
  drivers::Frame frame;
  frame.width = capabilities().width;
  frame.height = capabilities().height;
  frame.bits = capabilities().bits;
  frame.gamma = mechanics_->scene().camera.gamma;
  frame.samples = std::move(samples.luminance);
  if (samples.colour) frame.colour = [colour = std::move(samples.colour)] { return colour; };
  frame.sequence = exposure.sequence;
  frame.exposure_start = mechanics_->InstantOf(exposure.start);
  frame.exposure_end = mechanics_->InstantOf(exposure.start + exposure.length);
  return frame;
}

}  // namespace lensd::sim
