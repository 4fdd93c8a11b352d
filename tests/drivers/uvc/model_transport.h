// The simulated camera at the other end of a wire: on a stepped clock every transfer steps it, and takes no real time.
#pragma once

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "assemble.h"
#include "base/clock.h"
#include "grating_scene.h"
#include "sim/devices/uvc_model.h"
#include "sim/devices/uvc_stream.h"
#include "transport.h"

namespace lensd::drivers::uvc {

template <class ItsClock>
class TransportOn : public Transport {
 public:
  using Model = sim::devices::UvcModel;
  static constexpr Duration kTransfer = std::chrono::microseconds(250);

  TransportOn(ItsClock& clock, Model& model) : clock_(clock), model_(model), stream_(model) {}

  Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) override {
    using Outcome = Reply::Outcome;
    if (unplugged_) return {Outcome::Gone, {}};
    if (interrupted_) return {Outcome::NotSent, {}};
    ++transfers_;
    auto answer = model_.Control(setup.Bytes(), out);
    clock_.Advance(kTransfer);
    switch (answer.kind) {
      case Model::Answer::Kind::Stall:
        return {Outcome::Stalled, {}};
      case Model::Answer::Kind::Late:
        if (model_.faults().delay < timeout) {
          clock_.Advance(model_.faults().delay);
          break;
        }
        [[fallthrough]];
      case Model::Answer::Kind::Lost:
        clock_.Advance(timeout);
        return {Outcome::TimedOut, {}};
      case Model::Answer::Kind::Done:
        break;
    }
    return {Outcome::Done, setup.in() ? std::move(answer.data) : std::vector<std::uint8_t>()};
  }
  void WaitUntil(Instant until) override { clock_.AdvanceTo(until); }
  std::vector<std::vector<std::uint8_t>> TakeStatus() override {
    auto packets = unplugged_ ? std::vector<std::vector<std::uint8_t>>() : model_.TakeStatus();
    for (auto& stray : std::exchange(stray_, {})) packets.push_back(std::move(stray));
    if (std::exchange(lose_status_, false)) packets.clear();
    return packets;
  }
  Result<void> StartStream(const StreamPipe& pipe, PayloadSink& sink) override {
    if (unplugged_) return Fail(Code::Disconnected, "unplugged");
    pipe_ = pipe;
    sink_ = &sink;
    return {};
  }
  void StopStream() override {
    sink_ = nullptr;
    stream_.Stop();
  }
  bool Gone() const override { return unplugged_; }
  void BeginCall() override { interrupted_ = false; }
  void Interrupt() override { interrupted_ = true; }

  /// Sends what the camera has exposed by now.
  void Pump() {
    while (sink_ != nullptr && !unplugged_) {
      const auto payload = stream_.Next(pipe_.transfer_bytes);
      if (!payload || !*payload) return;
      sink_->OnPayload(**payload);
    }
  }

  void SetUnplugged(bool unplugged) { unplugged_ = unplugged; }
  void QueueStatus(std::vector<std::uint8_t> packet) { stray_.push_back(std::move(packet)); }
  void LoseStatus() { lose_status_ = true; }
  int transfers() const { return transfers_; }
  sim::devices::UvcStream& stream() { return stream_; }

 private:
  ItsClock& clock_;
  Model& model_;
  sim::devices::UvcStream stream_;
  std::atomic<bool> unplugged_ = false;
  std::atomic<bool> interrupted_ = false;
  int transfers_ = 0;
  std::vector<std::vector<std::uint8_t>> stray_;
  bool lose_status_ = false;
  StreamPipe pipe_;
  PayloadSink* sink_ = nullptr;
};
using ModelTransport = TransportOn<SteppedClock>;

/// The whole driver on that wire.
inline Result<Device> OpenOnModel(const std::shared_ptr<Transport>& transport, sim::devices::UvcModel& model,
                                  const Clock& clock, const UvcConfig& config) {
  const auto configuration = model.Configuration();
  auto selection = Select(configuration, config);
  if (!selection) return PassOn(selection);
  if (transport->Gone()) return Fail(Code::Disconnected, "unplugged");
  return MakeDevice(std::make_shared<Session>(transport, clock, selection->function, selection->terminal,
                                              Identity{"Simulated UVC camera", "SIM1"}, config.controls),
                    config);
}

/// A wall before a lens whose whole travel takes half a second; pictures of 32 x 24.
inline std::shared_ptr<const sim::Scene> SmallScene() {
  sim::Scene scene = testing::GratingScene(32, 24, 2048);
  scene.lens.max_focal_length_mm = 50.0;
  return std::make_shared<const sim::Scene>(std::move(scene));
}

}  // namespace lensd::drivers::uvc
