// Acquisition, exposure and clock of one GenICam camera. All of it runs on the control channel's thread; frames come
// from the stream's.
#include "aravis_camera.h"

#include <arv.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/api/thread_barrier.h"

namespace lensd::drivers::aravis {
namespace {

constexpr Duration kLatchDeadline = std::chrono::milliseconds(200);
constexpr std::string_view kTriggeredHere = "Software";
constexpr Duration kTriggerAgain = std::chrono::seconds(1);

CameraCapabilities CapabilitiesOf(const CameraFacts& facts, const std::string& trigger) {
  CameraCapabilities can;
  can.driver = "aravis";
  can.model = facts.model;
  can.serial = facts.serial;
  can.width = facts.width;
  can.height = facts.height;
  can.bits = facts.format->bits;
  can.colour = facts.format->colour != Colour::Mono;
  can.on_demand = trigger == kTriggeredHere;
  can.pixel_um = facts.pixel_um;
  can.frame_rate_hz = facts.frame_rate_hz;
  can.can_set_exposure = facts.can_set_exposure;
  can.shortest_exposure = facts.shortest_exposure;
  can.longest_exposure = facts.longest_exposure;
  can.gain = facts.gain;
  return can;
}

/// A way to have the camera write its clock down.
struct Latch {
  const char* command;
  const char* value;
  const char* frequency;  ///< ticks a second; nullptr: the value is in nanoseconds
};
constexpr Latch kLatches[] = {
    {"TimestampLatch", "TimestampLatchValue", nullptr},
    {"GevTimestampControlLatch", "GevTimestampValue", "GevTimestampTickFrequency"},
};

std::optional<std::uint64_t> IntegerOf(ArvCamera* camera, const char* feature) {
  CallError error;
  const gint64 value = arv_camera_get_integer(camera, feature, error.out());
  if (error || value < 0) return std::nullopt;
  return static_cast<std::uint64_t>(value);
}

/// The camera's clock in nanoseconds and when it was read at the earliest. The value latched must differ from the one
/// before to count.
struct ClockReading {
  std::uint64_t device_ns = 0;
  Instant before{};
};
std::optional<ClockReading> ReadClock(ArvCamera* camera, const Latch& latch) {
  const auto old = IntegerOf(camera, latch.value);
  const Instant before = std::chrono::steady_clock::now();
  CallError error;
  arv_camera_execute_command(camera, latch.command, error.out());
  if (error || !old) return std::nullopt;
  auto value = IntegerOf(camera, latch.value);
  while (value == old && std::chrono::steady_clock::now() < before + kLatchDeadline) {
    value = IntegerOf(camera, latch.value);
  }
  if (!value || value == old) return std::nullopt;
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  const auto frequency = latch.frequency == nullptr ? kNanoseconds : IntegerOf(camera, latch.frequency);
  if (!frequency || *frequency == 0) return std::nullopt;
  if (*frequency == kNanoseconds) return ClockReading{*value, before};
  const double ns = static_cast<double>(*value) * (1e9 / static_cast<double>(*frequency));
  return ClockReading{static_cast<std::uint64_t>(ns), before};
}

std::optional<ClockReading> ReadClock(ArvCamera* camera) {
  for (const Latch& latch : kLatches) {
    if (Has(camera, latch.command) && Has(camera, latch.value)) return ReadClock(camera, latch);
  }
  return std::nullopt;
}

}  // namespace

AravisCamera::AravisCamera(std::shared_ptr<AravisLink> link, const DriverConfig& config, const CameraFacts& facts,
                           const Clock& clock)
    : Camera(CapabilitiesOf(facts, config.camera.trigger)),
      link_(std::move(link)),
      config_(config),
      format_(*facts.format),
      clock_(clock),
      mailbox_(std::make_shared<Mailbox>(config.camera.trigger.empty() ? capabilities().frame_rate_hz : 0.0)) {
  shared_->clock = DeviceClock(config.camera.stamp);
  shared_->exposure = shared_->exposure_before = facts.exposure;
  SetHooks();
}

AravisCamera::~AravisCamera() {
  Contain([this] {
    link_->SetHooks({});
    link_->Post([shared = shared_](ArvCamera* camera) {
      {
        const std::lock_guard lock(shared->mutex);
        shared->wanted = false;
      }
      (void)End(camera, *shared);
    });
  });
}

/// The hooks share what they touch: this camera may go before its link does.
void AravisCamera::SetHooks() {
  AravisLink::Hooks hooks;
  hooks.lost = [shared = shared_] {
    (void)End(nullptr, *shared);
    const std::lock_guard lock(shared->mutex);
    shared->clock.Forget();
  };
  hooks.reopened = [shared = shared_, mailbox = mailbox_, config = config_.camera](ArvCamera* camera) {
    std::optional<Duration> exposure;
    std::optional<double> gain;
    bool wanted = false;
    {
      const std::lock_guard lock(shared->mutex);
      exposure = shared->exposure_set;
      gain = shared->gain_set;
      wanted = shared->wanted;
    }
    CallError error, gain_error;
    if (exposure) arv_camera_set_exposure_time(camera, static_cast<double>(exposure->count()) * 1e-3, error.out());
    if (gain) arv_camera_set_gain(camera, *gain, gain_error.out());
    if (wanted) (void)Begin(camera, config, *shared, mailbox);
  };
  hooks.every_second = [shared = shared_](ArvCamera*) {
    std::shared_ptr<Stream> stream;
    {
      const std::lock_guard lock(shared->mutex);
      stream = shared->stream;
    }
    if (stream) stream->Count();
  };
  link_->SetHooks(std::move(hooks));
}

/// On the link's thread.
Result<void> AravisCamera::Begin(ArvCamera* camera, const CameraConfig& config, Shared& shared,
                                 const std::shared_ptr<Mailbox>& mailbox) {
  const auto reading = ReadClock(camera);
  auto stream = Stream::Start(camera, config, mailbox);
  if (!stream) return PassOn(stream);
  const std::lock_guard lock(shared.mutex);
  if (reading) shared.clock.Latched(reading->device_ns, reading->before);
  shared.stream = *std::move(stream);
  return {};
}

/// On the link's thread; nullptr: the camera is not there.
Result<void> AravisCamera::End(ArvCamera* camera, Shared& shared) {
  std::shared_ptr<Stream> stream;
  {
    const std::lock_guard lock(shared.mutex);
    stream = std::exchange(shared.stream, nullptr);
  }
  if (!stream || camera == nullptr) return {};
  return stream->Stop(camera);
}

Counters AravisCamera::DoCount() const {
  Counters counts = mailbox_->counts();
  counts.bus_errors = failed_calls();
  return counts;
}

Result<void> AravisCamera::DoStart() {
  {
    const std::lock_guard lock(shared_->mutex);
    if (shared_->wanted && shared_->stream) return {};
    shared_->wanted = true;
  }
  triggered_at_.reset();
  auto started = link_->Call<void>([shared = shared_, mailbox = mailbox_, config = config_.camera](ArvCamera* camera) {
    {
      const std::lock_guard lock(shared->mutex);
      if (!shared->wanted || shared->stream) return Result<void>();
    }
    return Begin(camera, config, *shared, mailbox);
  });
  if (!started) (void)DoStop();
  return started;
}

Result<void> AravisCamera::DoStop() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->wanted = false;
  }
  auto stopped = link_->Call<void>([shared = shared_](ArvCamera* camera) { return End(camera, *shared); });
  // A camera that is not there does not stream.
  if (!stopped && stopped.error().code == Code::Disconnected) return {};
  return stopped;
}

Result<std::optional<Frame>> AravisCamera::DoPoll() {
  std::shared_ptr<Stream> stream;
  {
    const std::lock_guard lock(shared_->mutex);
    if (!shared_->wanted) return Fail(Code::InvalidArgument, "the camera is not streaming: start it first");
    stream = shared_->stream;
  }
  if (!stream || !link_->connected()) {
    return Fail(Code::Disconnected, "the camera with " + config_.Named() + " does not answer");
  }
  auto raw = mailbox_->Take();
  // A stamp that stands still belongs to a picture that was sent again.
  const bool again = raw && config_.camera.stamp != StampMeaning::Nothing && raw->device_ns == last_stamp_;
  if (!raw || again) {
    if (raw) stream->Return(std::move(raw->buffer));
    Trigger();
    return std::optional<Frame>();
  }
  last_stamp_ = raw->device_ns;
  triggered_at_.reset();
  auto frame = Develop(*raw);
  stream->Return(std::move(raw->buffer));
  if (!frame) {
    NoteUnusable(frame.error().message);
    return std::optional<Frame>();
  }
  NoteUsable();
  return std::optional<Frame>(*std::move(frame));
}

/// A camera on software trigger exposes only when asked.
void AravisCamera::Trigger() {
  if (config_.camera.trigger != kTriggeredHere) return;
  const Instant now = clock_.Now();
  if (triggered_at_ && now < *triggered_at_ + kTriggerAgain) return;
  triggered_at_ = now;
  link_->Post([](ArvCamera* camera) {
    if (camera == nullptr) return;
    CallError error;
    arv_camera_software_trigger(camera, error.out());
  });
}

Result<Frame> AravisCamera::Develop(const RawFrame& raw) {
  gint x_padding = 0, y_padding = 0;
  arv_buffer_get_image_padding(raw.buffer.get(), &x_padding, &y_padding);
  std::size_t size = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(raw.buffer.get(), &size));
  const int width = arv_buffer_get_image_width(raw.buffer.get());
  const int height = arv_buffer_get_image_height(raw.buffer.get());
  const std::uint32_t code = arv_buffer_get_image_pixel_format(raw.buffer.get());
  if (width != capabilities().width || height != capabilities().height || code != format_.code) {
    return Fail(Code::Protocol, "the camera sent a picture of another size or format than it was set to");
  }
  auto luma = LumaOf(format_, {data, size}, width, height, x_padding);
  if (!luma) return PassOn(luma);
  Frame frame;
  frame.width = width;
  frame.height = height;
  frame.bits = format_.bits;
  frame.gamma = config_.camera.gamma;
  frame.samples = std::make_shared<const std::vector<std::uint16_t>>(*std::move(luma));
  frame.colour = MakerOfColour(format_, {data, size}, width, height, x_padding);
  frame.sequence = raw.sequence;
  const std::lock_guard lock(shared_->mutex);
  const Duration longest = std::max(shared_->exposure, shared_->exposure_before);
  // Around a change the exposure of a frame is not known: the longer one covers both.
  const bool changing = raw.arrival < shared_->exposure_changed + 3 * longest + std::chrono::milliseconds(100);
  const Duration exposure = changing ? longest : shared_->exposure;
  const double rate = capabilities().frame_rate_hz;
  const Duration readout =
      rate > 0.0 ? std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1.0 / rate)) : Duration::zero();
  const ExposureInterval interval = shared_->clock.IntervalOf(raw.device_ns, raw.arrival, exposure, readout);
  frame.exposure_start = std::max(interval.start, last_start_ + Duration(1));
  frame.exposure_end = std::max(interval.end, frame.exposure_start);
  last_start_ = frame.exposure_start;
  return frame;
}

Result<void> AravisCamera::DoSetExposure(Duration exposure) {
  if (!capabilities().can_set_exposure) return Fail(Code::Unsupported, "this camera's exposure is fixed");
  return link_->Call<void>([shared = shared_, exposure](ArvCamera* camera) -> Result<void> {
    CallError error, read_error;
    arv_camera_set_exposure_time(camera, static_cast<double>(exposure.count()) * 1e-3, error.out());
    if (error) return error.Why("setting the exposure time");
    const double got_us = arv_camera_get_exposure_time(camera, read_error.out());
    if (read_error) return read_error.Why("reading the exposure time back");
    const std::lock_guard lock(shared->mutex);
    shared->exposure_before = shared->exposure;
    shared->exposure = Duration(std::llround(got_us * 1e3));
    shared->exposure_changed = std::chrono::steady_clock::now();
    shared->exposure_set = exposure;
    return {};
  });
}

/// What is read back tells what was set; the camera may round.
Result<void> AravisCamera::DoSetGain(double gain) {
  return link_->Call<void>([shared = shared_, gain](ArvCamera* camera) -> Result<void> {
    CallError error;
    arv_camera_set_gain(camera, gain, error.out());
    if (error) return error.Why("setting the gain");
    const std::lock_guard lock(shared->mutex);
    shared->gain_set = gain;
    return {};
  });
}

Result<ExposureState> AravisCamera::DoReadExposure() {
  const bool exposes = capabilities().can_set_exposure, gains = capabilities().gain.has_value();
  return link_->Call<ExposureState>([exposes, gains](ArvCamera* camera) -> Result<ExposureState> {
    CallError exposure_error, gain_error;
    ExposureState state;
    if (exposes) {
      const double us = arv_camera_get_exposure_time(camera, exposure_error.out());
      if (exposure_error) return exposure_error.Why("reading the exposure time");
      state.exposure = Duration(std::llround(us * 1e3));
    }
    if (gains) {
      state.gain = arv_camera_get_gain(camera, gain_error.out());
      if (gain_error) return gain_error.Why("reading the gain");
    }
    return state;
  });
}

}  // namespace lensd::drivers::aravis
