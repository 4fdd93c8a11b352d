// A USB camera with a motorised focus that tells where it is, control transfer by control transfer.
#include <random>

#include "bench/drivers/stand.h"
#include "tests/drivers/uvc/model_transport.h"

namespace lensd::bench {
namespace {

namespace uvc = drivers::uvc;
using sim::devices::UvcModel;

/// The simulated camera's wire with the weather on every control transfer.
class Spoiling final : public uvc::Transport {
 public:
  Spoiling(SteppedClock& clock, UvcModel& model) : model_(model), inner_(clock, model) {}

  uvc::Reply Control(const uvc::Setup& setup, std::span<const std::uint8_t> out, Duration timeout) override {
    auto& faults = model_.faults();
    faults = {};
    faults.delay = weather.late_by;
    faults.lose = Draw(weather.lost) ? 1 : 0;
    faults.late = Draw(weather.late) ? 1 : 0;
    faults.ignore = Draw(weather.disobeyed) ? 1 : 0;
    return inner_.Control(setup, out, timeout);
  }
  void WaitUntil(Instant until) override { inner_.WaitUntil(until); }
  std::vector<std::vector<std::uint8_t>> TakeStatus() override { return inner_.TakeStatus(); }
  Result<void> StartStream(const uvc::StreamPipe& pipe, uvc::PayloadSink& sink) override {
    return inner_.StartStream(pipe, sink);
  }
  void StopStream() override { inner_.StopStream(); }
  bool Gone() const override { return inner_.Gone(); }
  void BeginCall() override { inner_.BeginCall(); }
  void Interrupt() override { inner_.Interrupt(); }

  Weather weather;

 private:
  bool Draw(double probability) { return std::uniform_real_distribution<double>(0, 1)(random_) < probability; }
  UvcModel& model_;
  uvc::ModelTransport inner_;
  std::mt19937 random_{kWeatherSeed};
};

class UvcStand final : public ModelStand {
 public:
  UvcStand() : model_(UvcModel::Create(uvc::SmallScene(), clock_, {}).value()) {
    transport_ = std::make_shared<Spoiling>(clock_, *model_);
    config_.lens_config.feedback = drivers::Feedback::Encoder;
    config_.camera = false;
  }

  Result<drivers::Device> Open() override {
    auto selection = uvc::Select(model_->Configuration(), config_);
    if (!selection) return PassOn(selection);
    return uvc::MakeDevice(
        std::make_shared<uvc::Session>(transport_, clock_, selection->function, selection->terminal,
                                       uvc::Identity{"Simulated UVC camera", "SIM1"}, config_.controls),
        config_);
  }
  void SetWeather(const Weather& weather) override { transport_->weather = weather; }
  Result<void> BareExchange() override {
    const uvc::Setup question{.request_type = uvc::kGetInterface,
                              .request = uvc::kGetCur,
                              .value = static_cast<std::uint16_t>(uvc::kFocusAbsolute.selector << 8),
                              .index = static_cast<std::uint16_t>(UvcModel::kTerminal << 8),
                              .length = uvc::kFocusAbsolute.length};
    const auto reply = transport_->Control(question, {}, std::chrono::seconds(1));
    return reply.outcome == uvc::Reply::Outcome::Done ? Result<void>()
                                                      : Fail(Code::Protocol, "the simulated camera does not answer");
  }
  double TrueFocus() override { return model_->truth()->Now().focus_steps; }
  rig::RigConfig Config() const override {
    rig::RigConfig config;
    config.axes[drivers::Axis::Focus].speed = model_->scene().lens.speed_steps_per_s;
    return config;
  }

 private:
  std::unique_ptr<UvcModel> model_;
  std::shared_ptr<Spoiling> transport_;
  uvc::UvcConfig config_;
};

}  // namespace

std::unique_ptr<DriverStand> MakeUvcStand(const Weather&) {
  return std::make_unique<UvcStand>();
}

}  // namespace lensd::bench
