// A Computar LensConnect lens, report by report, behind the driver's transport seam.
#include <random>

#include "bench/drivers/stand.h"
#include "lensconnect_lens.h"
#include "tests/drivers/lensconnect/model_transport.h"

namespace lensd::bench {
namespace {

using drivers::lensconnect::LensConnectLens;
using drivers::lensconnect::Transport;
using sim::devices::LensConnectAxis;
using sim::devices::LensConnectFault;
using testing::ModelLens;
using testing::ModelTransport;

/// The weather and what it is drawn with, shared with a transport that the driver owns.
struct Sky {
  Weather weather;
  std::mt19937 random{kWeatherSeed};
  bool Draw(double probability) { return std::uniform_real_distribution<double>(0, 1)(random) < probability; }
};

/// Lets the weather act on every report that is sent.
class Spoiling final : public Transport {
 public:
  Spoiling(std::shared_ptr<ModelLens> model, SteppedClock& clock, std::shared_ptr<Sky> sky)
      : model_(model), inner_(std::move(model), clock), sky_(std::move(sky)) {}
  Result<void> Write(std::span<const std::uint8_t> report) override {
    sim::devices::LensConnect& lens = model_->lens;
    lens.EndFaults();
    if (sky_->Draw(sky_->weather.lost)) lens.Spoil(LensConnectFault::LostReply);
    if (sky_->Draw(sky_->weather.late)) lens.Spoil(LensConnectFault::LateReply);
    if (sky_->Draw(sky_->weather.disobeyed)) lens.Spoil(LensConnectFault::Ignored);
    return inner_.Write(report);
  }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    return inner_.Read(buffer, patience);
  }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override { return inner_.SetFeature(report); }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override { return inner_.GetFeature(buffer); }
  void Interrupt() override { inner_.Interrupt(); }
  void BeginCall() override { inner_.BeginCall(); }

 private:
  std::shared_ptr<ModelLens> model_;
  ModelTransport inner_;
  std::shared_ptr<Sky> sky_;
};

class LensConnectStand final : public ModelStand {
 public:
  explicit LensConnectStand(const Weather& weather)
      : model_(std::make_shared<ModelLens>(clock_, TraitsFor(weather))), sky_(std::make_shared<Sky>()) {}

  Result<drivers::Device> Open() override {
    drivers::Findings findings;
    auto lens = LensConnectLens::Open(std::make_unique<Spoiling>(model_, clock_, sky_), {}, "bench", findings, clock_);
    if (!lens) return PassOn(lens);
    return drivers::Device{.lens = *std::move(lens), .camera = nullptr, .optics = {}};
  }
  void SetWeather(const Weather& weather) override { sky_->weather = weather; }
  Result<void> BareExchange() override {
    // The bridge's question for the state of its last transfer, and its answer.
    constexpr std::uint8_t kStatusRequest[] = {0x15, 0x01};
    ModelTransport wire(model_, clock_);
    std::uint8_t answer[64];
    if (auto sent = wire.Write(kStatusRequest); !sent) return sent;
    const auto got = wire.Read(answer, std::chrono::seconds(1));
    if (!got) return PassOn(got);
    return *got > 0 ? Result<void>() : Fail(Code::Timeout, "the simulated LensConnect bridge does not answer");
  }
  double TrueFocus() override { return model_->lens.motor(LensConnectAxis::Focus).Position(clock_.Now()); }

 private:
  static sim::devices::LensConnectTraits TraitsFor(const Weather& weather) {
    sim::devices::LensConnectTraits traits;
    traits.late_by = weather.late_by;
    return traits;
  }
  std::shared_ptr<ModelLens> model_;
  std::shared_ptr<Sky> sky_;
};

}  // namespace

std::unique_ptr<DriverStand> MakeLensConnectStand(const Weather& weather) {
  return std::make_unique<LensConnectStand>(weather);
}

}  // namespace lensd::bench
