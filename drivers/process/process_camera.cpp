// A camera in a process: a frame is written into memory that both share, and copied once. Its colours are asked for on
// a connection of their own, from the thread that wants to show them.
#include <mutex>
#include <utility>

#include "frame_memory.h"
#include "parts.h"

namespace lensd::drivers::process {
namespace {

using wire::Json;

constexpr std::int64_t kFrameSlot = 0, kColourSlot = 1;
constexpr Duration kColourAtMost = std::chrono::seconds(5);

/// Samples of a reply: of the slot, or inline. Null where there are none, or not as many.
std::shared_ptr<Samples> SamplesIn(const Json& reply, const FrameMemory* memory, std::int64_t slot, std::size_t count,
                                   int bits) {
  const auto text = reply.find("samples");
  std::shared_ptr<Samples> samples;
  if (text != reply.end() && text->is_string()) {
    samples = InlineSamples(text->get_ref<const std::string&>(), count);
  } else if (memory != nullptr && static_cast<std::int64_t>(count * sizeof(std::uint16_t)) <= memory->slot_bytes()) {
    samples = memory->Copy(slot, count);
  }
  if (samples) CutToBits(*samples, bits);
  return samples;
}

/// Where the colours of frames come from. Any thread; outlives its camera, and then there are none.
class Colours {
 public:
  Colours(std::unique_ptr<Link> link, std::string device, std::size_t count, int bits)
      : link_(std::move(link)), device_(std::move(device)), count_(count), bits_(bits) {}

  void Use(std::shared_ptr<FrameMemory> memory) {
    const std::lock_guard lock(mutex_);
    memory_ = std::move(memory);
  }
  void Close() { link_->Shut(); }
  std::shared_ptr<const Samples> Of(std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    if (broken_) return nullptr;
    Json parameters{{"device", device_}, {"sequence", sequence}};
    if (memory_) parameters["slot"] = kColourSlot;
    const Instant deadline = MonotonicClock().Now() + kColourAtMost;
    const auto number = link_->Send("Colour", std::move(parameters), deadline);
    const auto reply = number ? link_->Receive(*number, deadline, -1) : PassOn(number);
    broken_ = !reply;
    if (broken_ || !reply->error.empty() || !reply->parameters.value("found", Json(false)).is_boolean()) return nullptr;
    if (!reply->parameters.value("found", Json(false)).get<bool>()) return nullptr;
    return SamplesIn(reply->parameters, memory_.get(), kColourSlot, count_, bits_);
  }

 private:
  const std::unique_ptr<Link> link_;
  const std::string device_;
  const std::size_t count_;  ///< samples
  const int bits_;
  std::mutex mutex_;  // guards what follows, and the use of link_
  std::shared_ptr<FrameMemory> memory_;
  bool broken_ = false;
};

class ProcessCamera final : public Camera {
 public:
  ProcessCamera(std::shared_ptr<Remote> remote, CameraCapabilities can, const Clock& clock)
      : Camera(std::move(can)), remote_(std::move(remote)), clock_(clock) {
    if (!capabilities().colour) return;
    auto link = remote_->ConnectForColours();
    if (!link) return;  // frames are without colour then
    colours_ = std::make_shared<Colours>(*std::move(link), remote_->device(), 3 * pixels(), capabilities().bits);
  }
  ~ProcessCamera() override {
    if (colours_) colours_->Close();
  }

 private:
  std::size_t pixels() const {
    return static_cast<std::size_t>(capabilities().width) * static_cast<std::size_t>(capabilities().height);
  }

  Result<Json> Call(std::string_view method, Json parameters = Json::object(), int pass = -1) {
    return remote_->Call(Remote::By::Camera, method, std::move(parameters), pass);
  }

  Result<void> DoStart() override {
    const auto slot_bytes = static_cast<std::int64_t>((colours_ ? 3 : 1) * pixels() * sizeof(std::uint16_t));
    auto memory = FrameMemory::Make(colours_ ? 2 : 1, slot_bytes);
    Json parameters = Json::object();
    if (memory) parameters = {{"slots", memory->slots()}, {"slotBytes", memory->slot_bytes()}};
    const auto started = Call("StartStream", std::move(parameters), memory ? memory->descriptor() : -1);
    if (!started) return PassOn(started);
    const auto taken = started->find("slots");
    if (taken == started->end() || *taken != true) memory.reset();
    memory_ = std::move(memory);
    if (colours_) colours_->Use(memory_);
    return {};
  }

  Result<void> DoStop() override {
    const auto stopped = Call("StopStream");
    if (!stopped) return PassOn(stopped);
    return {};
  }

  Result<std::optional<Frame>> DoPoll() override {
    Json parameters = Json::object();
    if (memory_) parameters["slot"] = kFrameSlot;
    const auto reply = Call("NextFrame", std::move(parameters));
    if (!reply) return PassOn(reply);
    if (auto noted = Note(*reply); !noted) return PassOn(noted);
    const auto json = reply->find("frame");
    if (json == reply->end() || json->is_null()) return std::nullopt;
    auto frame = wire::FrameFrom(*json, capabilities(), clock_.Now());
    if (!frame) return PassOn(frame);
    frame->samples = SamplesIn(*json, memory_.get(), kFrameSlot, pixels(), capabilities().bits);
    if (!frame->samples) return Fail(Code::Protocol, "the driver sent a frame without its samples, or not as many");
    if (colours_ && wire::FrameHasColour(*json)) {
      frame->colour = [colours = colours_, sequence = frame->sequence] { return colours->Of(sequence); };
    }
    return *std::move(frame);
  }

  /// What comes with every reply.
  Result<void> Note(const Json& reply) {
    if (const auto json = reply.find("counters"); json != reply.end() && !json->is_null()) {
      const auto counters = wire::CountersFrom(*json);
      if (!counters) return PassOn(counters);
      counters_ = *counters;
    }
    const auto json = reply.find("unusable");
    if (json == reply.end() || json->is_null()) return {};
    auto unusable = wire::UnusableFrom(*json);
    if (!unusable) return PassOn(unusable);
    unusable_ = *std::move(unusable);
    return {};
  }

  Result<void> DoSetExposure(Duration exposure) override {
    const auto set = Call("SetExposure", {{"exposureMs", wire::Milliseconds(exposure)}});
    if (!set) return PassOn(set);
    return {};
  }
  Result<void> DoSetGain(double gain) override {
    const auto set = Call("SetGain", {{"gain", gain}});
    if (!set) return PassOn(set);
    return {};
  }
  Result<ExposureState> DoReadExposure() override {
    const auto reply = Call("GetExposure");
    if (!reply) return PassOn(reply);
    return wire::ExposureFrom(*reply);
  }
  void DoInterrupt() override { remote_->Interrupt(); }
  Counters DoCount() const override {
    Counters counters = counters_;
    counters.bus_errors = std::max(counters.bus_errors, failed_calls());
    return counters;
  }
  UnusableFrames DoTellUnusable() const override { return unusable_; }

  const std::shared_ptr<Remote> remote_;
  const Clock& clock_;
  std::shared_ptr<Colours> colours_;     ///< null: frames are without colour
  std::shared_ptr<FrameMemory> memory_;  ///< null: frames come inline
  Counters counters_;                    ///< of the newest reply
  UnusableFrames unusable_;
};

}  // namespace

std::unique_ptr<Camera> MakeCamera(std::shared_ptr<Remote> remote, CameraCapabilities can, const Clock& clock) {
  return std::make_unique<ProcessCamera>(std::move(remote), std::move(can), clock);
}

}  // namespace lensd::drivers::process
