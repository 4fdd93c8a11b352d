// The driver on a simulated camera, as a process. The camera is plugged in while the file that its settings name is
// there.
#include <unistd.h>

#include <mutex>
#include <thread>

#include "drivers/host/host.h"
#include "model_transport.h"
#include "sleeping_clock.h"

namespace lensd::drivers::uvc {
namespace {

using testing::SleepingClock;

/// Its pictures come from a thread of its own, as libusb's do.
class Plugged final : public TransportOn<SleepingClock> {
 public:
  Plugged(SleepingClock& clock, std::unique_ptr<Model> model, std::string file)
      : TransportOn(clock, *model), model_(std::move(model)), file_(std::move(file)) {
    Look();
  }
  ~Plugged() override { StopStream(); }

  Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) override {
    Look();
    const std::lock_guard lock(mutex_);
    return TransportOn::Control(setup, out, timeout);
  }
  std::vector<std::vector<std::uint8_t>> TakeStatus() override {
    const std::lock_guard lock(mutex_);
    return TransportOn::TakeStatus();
  }
  Result<void> StartStream(const StreamPipe& pipe, PayloadSink& sink) override {
    Look();
    StopStream();
    const std::lock_guard lock(mutex_);
    auto started = TransportOn::StartStream(pipe, sink);
    if (started) pump_ = std::jthread([this](const std::stop_token& stop) { PumpUntil(stop); });
    return started;
  }
  void StopStream() override {
    pump_ = {};
    const std::lock_guard lock(mutex_);
    TransportOn::StopStream();
  }
  bool Gone() const override { return TransportOn::Gone() || access(file_.c_str(), F_OK) != 0; }

 private:
  void Look() { SetUnplugged(access(file_.c_str(), F_OK) != 0); }
  void PumpUntil(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      {
        const std::lock_guard lock(mutex_);
        Pump();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  const std::unique_ptr<Model> model_;
  const std::string file_;
  std::mutex mutex_;  // guards the model
  std::jthread pump_;
};

Result<Device> OpenModel(const Settings& settings, const Clock&) {
  static SleepingClock clock;
  SettingsReader read(settings, "the model");
  const std::string file = read.RequiredText("plugged");
  if (auto done = read.Finish(); !done) return PassOn(done);
  sim::Scene scene = *SmallScene();
  scene.lens.speed_steps_per_s *= 4;  // its time is the test's
  auto made = sim::devices::UvcModel::Create(std::make_shared<const sim::Scene>(std::move(scene)), clock, {});
  if (!made) return PassOn(made);
  sim::devices::UvcModel& model = **made;
  UvcConfig config;
  config.lens_config.feedback = Feedback::Counts;
  return OpenOnModel(std::make_shared<Plugged>(clock, *std::move(made), file), model, clock, config);
}

}  // namespace
}  // namespace lensd::drivers::uvc

int main() {
  lensd::drivers::host::RunHost({.name = "uvc", .open = lensd::drivers::uvc::OpenModel});
}
