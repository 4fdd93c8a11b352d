// A lens and camera that survive their device: Disconnected while it is gone, opened again by a thread of its own.
#include "daemon/lens/replug.h"

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/guarded.h"
#include "daemon/threads/growing_pauses.h"
#include "daemon/threads/retry.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;

/// An axis that was left out before is not missed, and not used either where it works now.
bool SameAxes(const drivers::Capabilities& before, const drivers::Findings& findings,
              const drivers::Capabilities& now) {
  for (const Axis axis : drivers::kAxes) {
    if (!before.axes[axis] && findings.Of(drivers::AxisName(axis)) != nullptr) continue;
    if (before.axes[axis].has_value() != now.axes[axis].has_value()) return false;
    if (!before.axes[axis]) continue;
    const auto& x = *before.axes[axis];
    const auto& y = *now.axes[axis];
    if (x.unit != y.unit || x.minimum != y.minimum || x.maximum != y.maximum || x.resolution != y.resolution)
      return false;
  }
  return true;
}

/// What a process that ended has left moving.
void StopWhatMoves(drivers::Lens& lens) {
  const auto state = lens.Read();
  for (const Axis axis : drivers::kAxes) {
    const auto& can = lens.capabilities().axes[axis];
    const bool moves = state && state->axes[axis] && state->axes[axis]->moving;
    if (moves && can && can->can_stop) (void)lens.Stop(axis);  // that it moves on is seen in what it reads later
  }
}

drivers::Counters Sum(drivers::Counters sum, const drivers::Counters& more) {
  sum.frames += more.frames;
  sum.frames_lost += more.frames_lost;
  sum.frames_late += more.frames_late;
  sum.packets_lost += more.packets_lost;
  sum.packets_resent += more.packets_resent;
  sum.frames_damaged += more.frames_damaged;
  sum.frames_flawed += more.frames_flawed;
  sum.bus_errors += more.bus_errors;
  return sum;
}

/// What lens and camera share. The worker's thread calls everything but Interrupt() and what Retry runs.
class Slot {
 public:
  Slot(drivers::Device device, std::function<Result<drivers::Device>()> open, PlugSignal& signal, ComesBack comes_back)
      : device_(std::move(device)), comes_back_(comes_back), open_(std::move(open)), signal_(signal) {
    first_.findings = device_.findings;
    if (device_.lens) first_.lens = device_.lens->capabilities();
    if (device_.camera) first_.camera = device_.camera->capabilities();
  }

  /// The device, taken over from the thread that opened it where it is back; else why there is none.
  Result<drivers::Device*> Get() {
    const std::lock_guard lock(mutex_);
    if (back_) {
      device_ = *std::exchange(back_, std::nullopt);
      gone_.reset();
      pauses_.Works(MonotonicClock().Now());
      ++generation_;
    }
    if (gone_) return PassOn(*gone_);
    return &device_;
  }
  /// How often it has come back.
  int generation() const { return generation_; }
  bool reference_comes_back() const { return comes_back_.reference; }

  /// Passes a call's answer on, and closes the device where the answer is that it is gone.
  template <class T>
  Result<T> Judge(Result<T> answer) {
    if (!answer && answer.error().code == Code::Disconnected) Lose(answer.error());
    return answer;
  }

  /// From any thread.
  /// What the device says of itself, closed ones included; the worker's thread.
  drivers::Counters camera_counts() const {
    return Sum(closed_.camera, !gone_ && device_.camera ? device_.camera->counters() : drivers::Counters{});
  }
  std::uint64_t lens_errors() const { return closed_.lens + (!gone_ && device_.lens ? device_.lens->bus_errors() : 0); }

  template <class Call>
  void Interrupt(Call call) {
    const std::lock_guard lock(mutex_);
    if (!gone_) call(device_);
  }

 private:
  /// Closing may wait for what the device has in hand, which is no concern of a client that is told that it is gone.
  void Lose(Error why) {
    closed_.camera = camera_counts();
    closed_.lens = lens_errors();
    const auto lost = std::make_shared<drivers::Device>();
    {
      const std::lock_guard lock(mutex_);
      std::swap(*lost, device_);
      gone_ = std::move(why);
    }
    const auto close_and_try = [this, lost] {
      *lost = {};
      return TryToOpen();
    };
    retry_.emplace(signal_, close_and_try, comes_back_.process ? pauses_.Next(MonotonicClock().Now()) : Duration{});
  }

  bool TryToOpen() {
    Result<drivers::Device> opened = Fail(Code::Internal, "");
    if (auto thrown = Guarded("opening", [&] { opened = open_(); })) opened = PassOn(*thrown);
    Error why{Code::Disconnected, ""};
    if (!opened) {
      // What cannot be done by what is there now, and could be by what was there: it is not the same.
      const bool another = opened.error().code == Code::WrongDevice || opened.error().code == Code::Unsupported;
      why = {another ? Code::WrongDevice : Code::Disconnected, opened.error().message};
    } else if (auto misfit = Misfit(*opened); !misfit.empty()) {
      why = {Code::WrongDevice, std::move(misfit)};
      opened = PassOn(why);
    }
    if (opened && comes_back_.process && opened->lens) StopWhatMoves(*opened->lens);
    const std::lock_guard lock(mutex_);
    if (!opened) {
      gone_ = std::move(why);
      return false;
    }
    back_ = *std::move(opened);
    return true;
  }

  /// Empty, or in what the device differs from the one before.
  std::string Misfit(const drivers::Device& other) const {
    const std::string end = "; restart lensd if that is meant";
    if (first_.lens && !other.lens) return "the device there has no lens" + Why("", other.findings) + end;
    if (first_.camera && !other.camera) return "the device there has no camera" + Why("camera", other.findings) + end;
    if (!first_.lens && other.lens) return "the device there has a lens" + end;
    if (!first_.camera && other.camera && first_.findings.Of("camera") == nullptr)
      return "the device there has a camera" + end;
    if (first_.lens) {
      const auto& can = other.lens->capabilities();
      if (const auto who = Another(*first_.lens, can); !who.empty()) return who + end;
      if (!SameAxes(*first_.lens, first_.findings, can)) {
        return "the lens came back with other axes or ranges" + Why("", other.findings) + end;
      }
    }
    if (!first_.camera) return "";
    const auto& can = other.camera->capabilities();
    if (const auto who = Another(*first_.camera, can); !who.empty()) return who + end;
    const bool same =
        can.width == first_.camera->width && can.height == first_.camera->height && can.bits == first_.camera->bits;
    return same ? "" : "the camera came back with another picture size or format" + end;
  }

  /// Why a part was left out this time; an empty `part`: any of them.
  static std::string Why(std::string_view part, const drivers::Findings& now) {
    for (const drivers::LeftOut& one : now.left_out()) {
      if (part.empty() || one.part == part) return " (" + one.part + " cannot be used: " + one.reason + ")";
    }
    return "";
  }

  template <class Described>
  static std::string Another(const Described& before, const Described& now) {
    if (before.model == now.model && before.serial == now.serial) return "";
    return "another device has taken its place: " + Named(now.model, now.serial) + " instead of " +
           Named(before.model, before.serial);
  }
  static std::string Named(const std::string& model, const std::string& serial) {
    return model + (serial.empty() ? "" : " with serial number " + serial);
  }

  std::mutex mutex_;
  drivers::Device device_;               // replaced under mutex_, used by the worker's thread
  std::optional<drivers::Device> back_;  // guarded by mutex_
  std::optional<Error> gone_;            // why there is none; guarded by mutex_
  int generation_ = 0;
  GrowingPauses pauses_{MonotonicClock().Now()};
  const ComesBack comes_back_;
  struct {
    drivers::Counters camera;
    std::uint64_t lens = 0;
  } closed_;  ///< counted of devices that were closed
  struct {
    std::optional<drivers::Capabilities> lens;
    std::optional<drivers::CameraCapabilities> camera;
    drivers::Findings findings;
  } first_;  ///< what was opened first, and must come back
  std::function<Result<drivers::Device>()> open_;
  PlugSignal& signal_;
  std::optional<Retry> retry_;  // last: its thread uses the others
};

class ReplugLens final : public drivers::Lens {
 public:
  ReplugLens(std::shared_ptr<Slot> slot, drivers::Capabilities can) : Lens(std::move(can)), slot_(std::move(slot)) {}

 private:
  template <class Call>
  auto Forward(Call call) -> decltype(call(std::declval<drivers::Lens&>())) {
    auto device = slot_->Get();
    if (!device) return PassOn(device);
    if (std::exchange(generation_, slot_->generation()) != generation_) {
      for (const Axis axis : drivers::kAxes)
        unknown_[axis] =
            !slot_->reference_comes_back() && capabilities().axes[axis] && capabilities().axes[axis]->can_home;
    }
    return slot_->Judge(call(*(*device)->lens));
  }

  Result<void> DoStartHome(Axis axis) override {
    auto started = Forward([&](drivers::Lens& lens) { return lens.StartHome(axis); });
    if (started) unknown_[axis] = false;
    return started;
  }
  Result<void> DoStartMove(Axis axis, Native target) override {
    return Forward([&](drivers::Lens& lens) -> Result<void> {
      if (unknown_[axis] && capabilities().axes[axis]->needs_home) {
        return Fail(Code::NotHomed, "where " + std::string(AxisName(axis)) +
                                        " is has been unknown since the lens was plugged in again; home it first");
      }
      return lens.StartMove(axis, target);
    });
  }
  Result<drivers::LensState> DoRead() override {
    auto state = Forward([](drivers::Lens& lens) { return lens.Read(); });
    if (!state) return state;
    for (const Axis axis : drivers::kAxes) {
      if (state->axes[axis] && unknown_[axis]) state->axes[axis]->homed = false;
    }
    return state;
  }
  Result<void> DoStop(Axis axis) override {
    return Forward([&](drivers::Lens& lens) { return lens.Stop(axis); });
  }
  void DoInterrupt() override {
    slot_->Interrupt([](drivers::Device& device) { device.lens->Interrupt(); });
  }
  void DoCutReadShort() override {
    slot_->Interrupt([](drivers::Device& device) { device.lens->CutReadShort(); });
  }
  std::uint64_t DoCountBusErrors() const override { return slot_->lens_errors(); }

  std::shared_ptr<Slot> slot_;
  int generation_ = 0;
  drivers::PerAxis<bool> unknown_{};
};

class ReplugCamera final : public drivers::Camera {
 public:
  ReplugCamera(std::shared_ptr<Slot> slot, drivers::CameraCapabilities can)
      : Camera(std::move(can)), slot_(std::move(slot)) {}

 private:
  template <class Call>
  auto Forward(Call call) -> decltype(call(std::declval<drivers::Camera&>())) {
    auto device = slot_->Get();
    if (!device) return PassOn(device);
    drivers::Camera& camera = *(*device)->camera;
    if (generation_ != slot_->generation()) {
      if (auto resumed = slot_->Judge(Resume(camera)); !resumed) return PassOn(resumed);
      generation_ = slot_->generation();
    }
    return slot_->Judge(call(camera));
  }
  /// Brings a camera that is back into the state its user left it in.
  Result<void> Resume(drivers::Camera& camera) {
    if (wanted_.exposure) {
      if (auto set = camera.SetExposure(*wanted_.exposure); !set) return set;
    }
    if (wanted_.gain) {
      if (auto set = camera.SetGain(*wanted_.gain); !set) return set;
    }
    return streaming_ ? camera.Start() : Result<void>();
  }

  Result<void> DoStart() override {
    auto started = Forward([](drivers::Camera& camera) { return camera.Start(); });
    if (started) streaming_ = true;
    return started;
  }
  Result<void> DoStop() override {
    streaming_ = false;
    return Forward([](drivers::Camera& camera) { return camera.Stop(); });
  }
  Result<std::optional<drivers::Frame>> DoPoll() override {
    return Forward([this](drivers::Camera& camera) {
      auto frame = camera.Poll();
      unusable_ = camera.unusable();
      return frame;
    });
  }
  Result<void> DoSetExposure(Duration exposure) override {
    auto set = Forward([&](drivers::Camera& camera) { return camera.SetExposure(exposure); });
    if (set) wanted_.exposure = exposure;
    return set;
  }
  Result<void> DoSetGain(double gain) override {
    auto set = Forward([&](drivers::Camera& camera) { return camera.SetGain(gain); });
    if (set) wanted_.gain = gain;
    return set;
  }
  Result<drivers::ExposureState> DoReadExposure() override {
    return Forward([](drivers::Camera& camera) { return camera.ReadExposure(); });
  }
  void DoInterrupt() override {
    slot_->Interrupt([](drivers::Device& device) { device.camera->Interrupt(); });
  }
  drivers::Counters DoCount() const override { return slot_->camera_counts(); }
  drivers::UnusableFrames DoTellUnusable() const override { return unusable_; }

  std::shared_ptr<Slot> slot_;
  int generation_ = 0;
  bool streaming_ = false;
  drivers::ExposureState wanted_;     ///< what its user has set
  drivers::UnusableFrames unusable_;  ///< of the newest poll
};

}  // namespace

drivers::Device SurviveUnplugging(drivers::Device device, std::function<Result<drivers::Device>()> open,
                                  PlugSignal& signal, ComesBack comes_back) {
  drivers::Device outer;
  outer.optics = device.optics;
  outer.findings = device.findings;
  std::optional<drivers::Capabilities> lens;
  std::optional<drivers::CameraCapabilities> camera;
  if (device.lens) lens = device.lens->capabilities();
  if (device.camera) camera = device.camera->capabilities();
  auto slot = std::make_shared<Slot>(std::move(device), std::move(open), signal, comes_back);
  if (lens) outer.lens = std::make_unique<ReplugLens>(slot, *std::move(lens));
  if (camera) outer.camera = std::make_unique<ReplugCamera>(slot, *std::move(camera));
  return outer;
}

}  // namespace lensd::daemon
