// Frames of a USB camera: choosing the stream, exposure, gamma by its colour description, and pictures to luminance.
#include "uvc_camera.h"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/api/thread_barrier.h"
#include "drivers/pixels/sizes.h"

namespace lensd::drivers::uvc {
namespace {

constexpr Duration kExposureUnit = std::chrono::microseconds(100);
constexpr Duration kIntervalUnit = Duration(100);
constexpr double kVideoGamma = 2.2;

/// By the numbers of the colour matching descriptor (UVC 1.1 section 3.9.2.6). Unsaid means BT.709 there.
double GammaOf(std::uint8_t transfer_characteristics) {
  constexpr std::uint8_t kBt470Bg = 3, kLinear = 6;
  if (transfer_characteristics == kLinear) return 1.0;
  return transfer_characteristics == kBt470Bg ? 2.8 : kVideoGamma;
}

/// Of a control that can be used; nothing: it is left out.
Result<std::optional<ControlRange>> AskRange(Controls& controls, ControlAddress at, const UnitControl& control,
                                             const std::string& part, Findings& findings) {
  auto range = ReadRange(controls, at, control, part);
  if (range) return *range;
  if (ConcernsAll(range.error())) return PassOn(range);
  findings.LeaveOut(part, range.error());
  return std::nullopt;
}

std::int64_t HighestOf(const ControlRange& range) {
  return range.Nearest(static_cast<double>(range.maximum));
}

std::size_t MostBytes(const StreamChoice& choice) {
  // A JPEG picture larger than the raw one is a mistake.
  return static_cast<std::size_t>(choice.width) * static_cast<std::size_t>(choice.height) *
         static_cast<std::size_t>(InfoOf(choice.pixels).bytes_per_px);
}

}  // namespace

Result<std::unique_ptr<Camera>> UvcCamera::Open(std::shared_ptr<Session> session, const CameraConfig& config,
                                                Findings& findings) {
  session->transport().BeginCall();
  auto choice = Choose(session->function, config);
  if (!choice) return PassOn(choice);
  const auto ranges = AskRanges(*session, findings);
  if (!ranges) return PassOn(ranges);
  CameraCapabilities can;
  can.driver = "uvc";
  can.model = session->identity.model;
  can.serial = session->identity.serial;
  can.width = choice->width;
  can.height = choice->height;
  can.bits = InfoOf(choice->pixels).raw.bits;
  can.colour = pixels::HasColour(InfoOf(choice->pixels).raw);
  can.pixel_um = config.pixel_um;
  can.frame_rate_hz = 1e7 / choice->interval;
  Describe(*ranges, can);
  return std::unique_ptr<Camera>(new UvcCamera(std::move(can), std::move(session), config, *choice, *ranges));
}

UvcCamera::UvcCamera(CameraCapabilities capabilities, std::shared_ptr<Session> session, const CameraConfig& config,
                     const StreamChoice& choice, const Ranges& ranges)
    : Camera(std::move(capabilities)),
      session_(std::move(session)),
      config_(config),
      choice_(choice),
      period_(choice.interval * kIntervalUnit),
      ranges_(ranges),
      assembler_(session_->clock, choice.pixels, MostBytes(choice), 1e7 / choice.interval) {}

UvcCamera::~UvcCamera() {
  Contain([this] { (void)DoStop(); });
}

Result<UvcCamera::Ranges> UvcCamera::AskRanges(Session& session, Findings& findings) {
  Ranges ranges;
  if (session.terminal.id != 0 && session.terminal.Has(kExposureAbsolute.bit)) {
    auto exposure = AskRange(session.controls, session.At(kExposureAbsolute), kExposureAbsolute, "exposure", findings);
    if (!exposure) return PassOn(exposure);
    ranges.exposure = *exposure;
  }
  if (const ProcessingUnit* unit = UnitWithGain(session.function, session.terminal)) {
    ranges.gain_at = {kGain.selector, unit->id, session.function.interface};
    auto gain = AskRange(session.controls, ranges.gain_at, kGain, "gain", findings);
    if (!gain) return PassOn(gain);
    ranges.gain = *gain;
  }
  return ranges;
}

void UvcCamera::Describe(const Ranges& ranges, CameraCapabilities& can) {
  can.can_set_exposure = ranges.exposure.has_value();
  if (const auto& exposure = ranges.exposure) {
    can.shortest_exposure = exposure->minimum * kExposureUnit;
    can.longest_exposure = HighestOf(*exposure) * kExposureUnit;
    can.exposure_step = exposure->resolution * kExposureUnit;
  }
  if (const auto& gain = ranges.gain) {
    can.gain = GainRange{.lowest = static_cast<double>(gain->minimum),
                         .highest = static_cast<double>(HighestOf(*gain)),
                         .unit = GainUnit::Native,
                         .step = static_cast<double>(gain->resolution)};
  }
}

Result<Duration> UvcCamera::AskExposure() {
  if (!ranges_.exposure) return period_;
  auto bytes = session_->controls.TryGet(kGetCur, session_->At(kExposureAbsolute), 4, "exposure");
  if (!bytes) return PassOn(bytes);
  return *bytes ? FromLittle(**bytes) * kExposureUnit : period_;
}

Result<ExposureState> UvcCamera::DoReadExposure() {
  session_->transport().BeginCall();
  ExposureState state;
  if (ranges_.exposure) {
    auto bytes =
        session_->controls.TryGet(kGetCur, session_->At(kExposureAbsolute), kExposureAbsolute.length, "exposure");
    if (!bytes) return PassOn(bytes);
    if (*bytes) state.exposure = FromLittle(**bytes) * kExposureUnit;
  }
  if (ranges_.gain) {
    auto bytes = session_->controls.TryGet(kGetCur, ranges_.gain_at, kGain.length, "gain");
    if (!bytes) return PassOn(bytes);
    if (*bytes) state.gain = FromLittle(**bytes);
  }
  return state;
}

Counters UvcCamera::DoCount() const {
  Counters counts = assembler_.counts();
  counts.bus_errors = failed_calls();
  return counts;
}

Result<void> UvcCamera::DoStart() {
  session_->transport().BeginCall();
  if (streaming_) return {};
  auto exposure = AskExposure();
  if (!exposure) return PassOn(exposure);
  exposure_ = *exposure;
  auto pipe = Negotiate(*session_, choice_);
  if (!pipe) return PassOn(pipe);
  assembler_.Restart();
  NoteUsable();
  if (auto started = session_->transport().StartStream(*pipe, assembler_); !started) return started;
  streaming_ = true;
  last_sign_ = session_->clock.Now();
  return {};
}

Result<void> UvcCamera::DoStop() {
  session_->transport().BeginCall();
  if (std::exchange(streaming_, false)) session_->transport().StopStream();
  return {};
}

/// In words what became of the pictures that came since the last whole one.
void UvcCamera::NoteIncomplete() {
  const IncompleteFrames lost = assembler_.TakeIncomplete();
  if (lost.count == 0) return;
  const std::size_t row = pixels::RowBytes(InfoOf(choice_.pixels).raw, choice_.width);
  std::string why = "damaged: a part of it was lost on its way";
  if (!lost.lost_payload && choice_.pixels == PixelFormat::Mjpeg) why = "damaged: it is no JPEG picture";
  if (!lost.lost_payload && row > 0) {
    const auto wrong = pixels::WhyNotRows(lost.bytes, {choice_.width, choice_.height, row, row});
    if (wrong) why = *wrong;
  }
  NoteUnusable(why, lost.count);
}

Result<std::optional<Frame>> UvcCamera::DoPoll() {
  if (!streaming_) return Fail(Code::InvalidArgument, "the camera is not streaming: start it first");
  session_->transport().CheckThread();
  const Instant now = session_->clock.Now();
  auto raw = assembler_.Take();
  if (!raw) {
    NoteIncomplete();
    if (session_->transport().Gone()) return Fail(Code::Disconnected, "the camera is unplugged");
    if (now - last_sign_ <= config_.frame_timeout) return std::nullopt;
    last_sign_ = now;
    return Fail(Code::Timeout, "the camera sends no complete pictures");
  }
  const pixels::RawFormat& format = InfoOf(choice_.pixels).raw;
  auto samples = luma_.Read(format, {raw->bytes, choice_.width, choice_.height});
  auto colour = samples ? pixels::MakerOfColour(format, {raw->bytes, choice_.width, choice_.height}) : nullptr;
  assembler_.Recycle(std::move(raw->bytes));
  if (luma_.flawed()) assembler_.TurnedOutFlawed();
  // A damaged picture counts as lost: the next one is on its way.
  if (!samples) {
    NoteUnusable(samples.error().message);
    assembler_.TurnedOutDamaged(*raw);
    return std::nullopt;
  }
  NoteUsable();
  last_sign_ = now;
  Frame frame;
  frame.width = choice_.width;
  frame.height = choice_.height;
  frame.bits = format.bits;
  frame.gamma = config_.gamma.value_or(GammaOf(choice_.transfer_characteristics));
  frame.samples = *std::move(samples);
  frame.colour = std::move(colour);
  frame.sequence = raw->sequence;
  frame.exposure_start = raw->first - exposure_ - config_.latency.value_or(period_);
  frame.exposure_end = raw->last;
  return frame;
}

Result<void> UvcCamera::DoSetExposure(Duration exposure) {
  if (!ranges_.exposure) return Fail(Code::Unsupported, "this camera's exposure cannot be set");
  session_->transport().BeginCall();
  if (auto taken = session_->automatics.TakeExposure(); !taken) return taken;
  const double units = static_cast<double>(exposure.count()) / static_cast<double>(kExposureUnit.count());
  const std::int64_t value = ranges_.exposure->Nearest(units);
  const auto bytes = ToLittle(static_cast<std::uint32_t>(value), kExposureAbsolute.length);
  if (auto set = session_->controls.Set(session_->At(kExposureAbsolute), bytes, "exposure"); !set) return set;
  // Frames under way may still have the old one: the longer of both holds for what is said about them.
  exposure_ = std::max(exposure_, value * kExposureUnit);
  return {};
}

Result<void> UvcCamera::DoSetGain(double gain) {
  if (!ranges_.gain) return Fail(Code::Unsupported, "this camera's gain cannot be set");
  session_->transport().BeginCall();
  const auto bytes = ToLittle(static_cast<std::uint32_t>(ranges_.gain->Nearest(gain)), kGain.length);
  return session_->controls.Set(ranges_.gain_at, bytes, "gain");
}

}  // namespace lensd::drivers::uvc
