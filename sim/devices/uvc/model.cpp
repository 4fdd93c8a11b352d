// How the simulated camera answers requests: its terminal's controls, their ranges, and the faults injected.
#include <algorithm>
#include <cmath>
#include <utility>

#include "descriptors.h"
#include "sim/devices/uvc_model.h"

namespace lensd::sim::devices {
namespace {

using drivers::Axis;

enum Selector : std::uint8_t {
  kAeMode = 0x02,
  kExposure = 0x04,
  kFocus = 0x06,
  kFocusRelative = 0x07,
  kFocusAuto = 0x08,
  kIris = 0x09,
  kZoom = 0x0B,
};
/// Their bits in bmControls.
constexpr struct {
  Selector selector;
  int bit;
} kBits[] = {{kAeMode, 1}, {kExposure, 3}, {kFocus, 5}, {kFocusRelative, 6}, {kFocusAuto, 17}, {kIris, 7}, {kZoom, 9}};

enum Error : std::uint8_t {
  kNone = 0,
  kWrongState = 2,
  kOutOfRange = 4,
  kInvalidUnit = 5,
  kInvalidControl = 6,
  kInvalidRequest = 7
};

constexpr std::uint8_t kManual = 1, kAuto = 2, kShutterPriority = 4, kAperturePriority = 8;
constexpr std::size_t kProbeLength = 34;

std::uint32_t Little(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

std::vector<std::uint8_t> LittleBytes(std::uint32_t value, std::size_t length) {
  std::vector<std::uint8_t> bytes;
  Append(bytes, value, static_cast<int>(length));
  return bytes;
}

UvcModel::Answer Reply(std::vector<std::uint8_t> data = {}) {
  return {UvcModel::Answer::Kind::Done, std::move(data)};
}

Selector SelectorOf(Axis axis) {
  return axis == Axis::Iris ? kIris : axis == Axis::Zoom ? kZoom : kFocus;
}

}  // namespace

Result<std::unique_ptr<UvcModel>> UvcModel::Create(std::shared_ptr<const Scene> scene, const Clock& clock,
                                                   const UvcOptions& options) {
  if (scene->lens.steps > 65536) return Fail(Code::InvalidArgument, "a UVC focus has at most 65536 steps");
  auto world = OpenWorld(scene, clock, {});
  if (!world) return PassOn(world);
  return std::unique_ptr<UvcModel>(new UvcModel(std::move(scene), *std::move(world), options));
}

UvcModel::UvcModel(std::shared_ptr<const Scene> scene, World world, UvcOptions options)
    : scene_(std::move(scene)), world_(std::move(world)), options_(std::move(options)) {
  Reset();
}

void UvcModel::Reset() {
  auto_focus_ = options_.auto_at_start ? 1 : 0;
  ae_mode_ = options_.auto_at_start ? kAuto : kManual;
  error_ = kNone;
  image_.exposure = static_cast<std::uint32_t>(std::lround(scene_->camera.exposure_ms * 10));
  image_.gain = 0;
  announce_ = false;
  faults_ = {};
  for (const Axis axis : {Axis::Focus, Axis::Iris, Axis::Zoom}) {
    if (Has(SelectorOf(axis)) || axis == Axis::Focus)
      set_[axis] = std::clamp(Current(axis), RangeOf(axis).minimum, RangeOf(axis).maximum);
  }
  stream_.assign(kProbeLength, 0);
  stream_ = Negotiated(stream_);
}

bool UvcModel::Has(std::uint8_t selector) const {
  if (selector == kFocus || selector == kFocusAuto) return !options_.relative_only;
  if (selector == kZoom) return scene_->lens.zooms();
  return std::ranges::any_of(kBits, [&](const auto& one) { return one.selector == selector; });
}

std::vector<std::uint8_t> UvcModel::Configuration() const {
  std::uint32_t controls = 0;
  for (const auto& [selector, bit] : kBits) {
    if (Has(selector)) controls |= 1u << bit;
  }
  return ConfigurationDescriptor(options_, controls, scene_->camera);
}

UvcModel::Answer UvcModel::Control(std::span<const std::uint8_t, 8> setup, std::span<const std::uint8_t> out) {
  if ((setup[0] & 0x60) == 0) return Standard(setup);
  const Request request{
      setup[0], setup[1], setup[3], setup[5], setup[4], static_cast<std::uint16_t>(setup[6] | setup[7] << 8), out};
  if ((setup[0] & 0x7F) != 0x21 || setup[2] != 0) return Refuse(kInvalidRequest);
  if (request.interface == 1) return Streaming(request);
  if (request.entity == 0 && request.selector == 0x02) return Reply({error_});
  if (request.entity != kTerminal && request.entity != kUnit) return Refuse(kInvalidUnit);
  return Spoiled(request);
}

/// Standard requests, as far as a host needs them.
UvcModel::Answer UvcModel::Standard(std::span<const std::uint8_t, 8> setup) {
  constexpr std::uint8_t kGetStatus = 0, kClearFeature = 1, kSetFeature = 3, kGetDescriptor = 6, kGetConfiguration = 8,
                         kSetConfiguration = 9, kGetInterface = 10, kSetInterface = 11;
  const std::size_t length = setup[6] | setup[7] << 8;
  const auto cut = [&](std::vector<std::uint8_t> bytes) {
    bytes.resize(std::min(bytes.size(), length));
    return Reply(std::move(bytes));
  };
  switch (setup[1]) {
    case kGetStatus:
      return cut({0, 0});
    case kGetConfiguration:
      return cut({1});
    case kGetInterface:
      return cut({0});
    case kClearFeature:
    case kSetFeature:
    case kSetConfiguration:
    case kSetInterface:
      return Reply();
    case kGetDescriptor:
      if (setup[3] == 1) return cut(DeviceDescriptor());
      if (setup[3] == 2) return cut(Configuration());
      if (setup[3] == 3 && setup[2] <= 3) return cut(StringDescriptor(setup[2], options_.serial));
      break;
    default:
      break;
  }
  return {Answer::Kind::Stall, {}};
}

/// The terminal's or the unit's answer, and what the faults make of it.
UvcModel::Answer UvcModel::Spoiled(const Request& request) {
  const auto takes = [](int& count) {
    if (count <= 0) return false;
    --count;
    return true;
  };
  if (takes(faults_.stall)) return Refuse(faults_.error);
  const bool sets = request.code == 0x01;
  if (sets && takes(faults_.ignore)) return Reply();
  Answer answer = request.entity == kUnit ? Gain(request) : Terminal(request);
  if (!sets && answer.kind == Answer::Kind::Done && takes(faults_.shorten)) answer.data.pop_back();
  if (takes(faults_.lose)) answer.kind = Answer::Kind::Lost;
  if (answer.kind == Answer::Kind::Done && takes(faults_.late)) answer.kind = Answer::Kind::Late;
  return answer;
}

UvcModel::Answer UvcModel::Refuse(std::uint8_t error) {
  error_ = error;
  return {Answer::Kind::Stall, {}};
}

UvcModel::Answer UvcModel::Terminal(const Request& request) {
  if (!Has(request.selector)) return Refuse(kInvalidControl);
  switch (request.selector) {
    case kFocus:
      return Absolute(request, Axis::Focus);
    case kIris:
      return Absolute(request, Axis::Iris);
    case kZoom:
      return Absolute(request, Axis::Zoom);
    case kFocusRelative:
      return FocusRelative(request);
    case kFocusAuto:
      return Switch(request, auto_focus_, 0x01, 1);
    case kAeMode:
      return Switch(request, ae_mode_, kManual | kAuto | kShutterPriority | kAperturePriority, kAuto);
    default:
      return Exposure(request);
  }
}

/// The answers that need no more than the range; nullopt: GET_CUR or SET_CUR.
std::optional<UvcModel::Answer> UvcModel::Describe(const Request& request, const Range& range, std::uint8_t info,
                                                   std::size_t length) {
  const auto number = [&](std::uint32_t value) {
    auto bytes = LittleBytes(value, length);
    bytes.resize(std::min<std::size_t>(bytes.size(), request.length));
    return Reply(std::move(bytes));
  };
  switch (request.code) {
    case 0x01:
      if (request.out.size() != length) return Refuse(kInvalidRequest);
      return std::nullopt;
    case 0x81:
      return std::nullopt;
    case 0x82:
      return number(range.minimum);
    case 0x83:
      return number(range.maximum);
    case 0x84:
      return number(range.resolution);
    case 0x85:
      return Reply(LittleBytes(static_cast<std::uint32_t>(length), 2));
    case 0x86:
      return Reply({info});
    case 0x87:
      return number(range.standard);
    default:
      return Refuse(kInvalidRequest);
  }
}

/// A flag, or a bitmap of which one bit is set.
UvcModel::Answer UvcModel::Switch(const Request& request, std::uint8_t& value, std::uint8_t legal,
                                  std::uint8_t standard) {
  if (auto answer = Describe(request, {0, legal, legal, standard}, 0x03, 1)) return *answer;
  if (request.code == 0x81) return Reply({value});
  const std::uint8_t asked = request.out[0];
  const bool flag = legal == 0x01;
  if ((asked & ~legal) != 0 || (!flag && (asked == 0 || (asked & (asked - 1)) != 0))) return Refuse(kOutOfRange);
  value = asked;
  return Reply();
}

UvcModel::Range UvcModel::RangeOf(Axis axis) const {
  const LensSettings& lens = scene_->lens;
  if (axis == Axis::Iris) {
    return {static_cast<std::uint32_t>(std::lround(lens.min_f_number * 100)),
            static_cast<std::uint32_t>(std::lround(lens.max_f_number * 100)), 1,
            static_cast<std::uint32_t>(std::lround(lens.initial_f_number * 100))};
  }
  const auto& can = *world_.device.lens->capabilities().axes[axis];
  return {static_cast<std::uint32_t>(can.minimum.value), static_cast<std::uint32_t>(can.maximum.value), 1, 0};
}

/// Iris values are hundredths of f-numbers; the simulated iris has steps even in the logarithm of the f-number.
std::uint32_t UvcModel::Current(Axis axis) {
  const auto state = world_.device.lens->Read();
  if (!state || !state->axes[axis]) return 0;
  const double position = state->axes[axis]->position.value;
  if (axis != Axis::Iris) return static_cast<std::uint32_t>(std::lround(position));
  const auto& can = *world_.device.lens->capabilities().axes[axis];
  const double part = (position - can.minimum.value) / (can.maximum - can.minimum).value;
  const LensSettings& lens = scene_->lens;
  return static_cast<std::uint32_t>(
      std::lround(100 * lens.min_f_number * std::pow(lens.max_f_number / lens.min_f_number, part)));
}

void UvcModel::MoveTo(Axis axis, std::uint32_t value) {
  double target = value;
  if (axis == Axis::Iris) {
    const auto& can = *world_.device.lens->capabilities().axes[axis];
    const LensSettings& lens = scene_->lens;
    const double part = std::log(value / 100.0 / lens.min_f_number) / std::log(lens.max_f_number / lens.min_f_number);
    target = can.minimum.value + std::clamp(part, 0.0, 1.0) * (can.maximum - can.minimum).value;
  }
  (void)world_.device.lens->StartMove(axis, Native{target});
}

bool UvcModel::ByHand(Axis axis) const {
  if (axis == Axis::Focus) return auto_focus_ == 0;
  return axis != Axis::Iris || ae_mode_ == kManual || ae_mode_ == kAperturePriority;
}

UvcModel::Answer UvcModel::Absolute(const Request& request, Axis axis) {
  const bool announced = axis == Axis::Focus && options_.asynchronous;
  std::uint8_t info = announced ? 0x1B : 0x03;
  if (!ByHand(axis)) info |= 0x04;
  const Range range = RangeOf(axis);
  if (auto answer = Describe(request, range, info, 2)) return *answer;
  if (request.code == 0x81) {
    // The iris has coarser steps than its control: it shows the setting once it is as near as it gets.
    const bool shows_setting = options_.echo || axis == Axis::Iris;
    return Reply(LittleBytes(shows_setting ? set_[axis] : Current(axis), 2));
  }
  const std::uint32_t value = Little(request.out);
  if (!ByHand(axis)) return Refuse(kWrongState);
  if (value < range.minimum || value > range.maximum) return Refuse(kOutOfRange);
  set_[axis] = value;
  MoveTo(axis, value);
  announce_ = announce_ || announced;
  return Reply();
}

UvcModel::Answer UvcModel::Exposure(const Request& request) {
  const Range range{1, 10000, 1, static_cast<std::uint32_t>(std::lround(scene_->camera.exposure_ms * 10))};
  const bool by_hand = ae_mode_ == kManual || ae_mode_ == kShutterPriority;
  if (auto answer = Describe(request, range, by_hand ? 0x03 : 0x07, 4)) return *answer;
  if (request.code == 0x81) return Reply(LittleBytes(image_.exposure, 4));
  const std::uint32_t value = Little(request.out);
  if (!by_hand) return Refuse(kWrongState);
  if (value < range.minimum || value > range.maximum) return Refuse(kOutOfRange);
  image_.exposure = value;
  (void)world_.device.camera->SetExposure(value * std::chrono::microseconds(100));
  return Reply();
}

/// The one control of the processing unit.
UvcModel::Answer UvcModel::Gain(const Request& request) {
  constexpr std::uint8_t kGain = 0x04;
  if (request.selector != kGain) return Refuse(kInvalidControl);
  const Range range{0, 240, 5, 0};
  if (auto answer = Describe(request, range, 0x03, 2)) return *answer;
  if (request.code == 0x81) return Reply(LittleBytes(image_.gain, 2));
  const std::uint32_t value = Little(request.out);
  if (value > range.maximum || value % range.resolution != 0) return Refuse(kOutOfRange);
  image_.gain = value;
  (void)world_.device.camera->SetGain(0.1 * value);
  return Reply();
}

UvcModel::Answer UvcModel::FocusRelative(const Request& request) {
  // The direction byte of every answer is 0; there is one speed.
  if (auto answer = Describe(request, {0x0100, 0x0100, 0x0100, 0x0100}, 0x03, 2)) return *answer;
  if (request.code == 0x81) return Refuse(kInvalidRequest);
  if (!ByHand(Axis::Focus) && !options_.relative_only) return Refuse(kWrongState);
  const auto& can = *world_.device.lens->capabilities().axes[Axis::Focus];
  if (request.out[0] == 0) {
    (void)world_.device.lens->Stop(Axis::Focus);
  } else if (request.out[1] != 1 || (request.out[0] != 1 && request.out[0] != 0xFF)) {
    return Refuse(kOutOfRange);
  } else {
    // More extension focuses nearer.
    (void)world_.device.lens->StartMove(Axis::Focus, request.out[0] == 1 ? can.maximum : can.minimum);
  }
  return Reply();
}

std::vector<std::vector<std::uint8_t>> UvcModel::TakeStatus() {
  if (!announce_) return {};
  const auto state = world_.device.lens->Read();
  if (!state || state->axes[Axis::Focus]->moving) return {};
  announce_ = false;
  const std::uint32_t value = set_[Axis::Focus];
  return {
      {0x01, kTerminal, 0x00, kFocus, 0x00, static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8)}};
}

double UvcModel::FocusPosition() {
  const auto state = world_.device.lens->Read();
  return state ? state->axes[Axis::Focus]->position.value : -1.0;
}

/// What the camera agrees to: its one size in the format asked for, at its one rate.
std::vector<std::uint8_t> UvcModel::Negotiated(std::span<const std::uint8_t> asked) const {
  std::vector<std::uint8_t> agreed(asked.begin(), asked.end());
  if (agreed[2] < 1 || agreed[2] > (options_.grey_bits > 0 ? 3 : 2)) agreed[2] = 1;
  agreed[3] = 1;
  const auto put = [&](std::size_t at, std::uint32_t value) {
    std::ranges::copy(LittleBytes(value, 4), agreed.begin() + static_cast<std::ptrdiff_t>(at));
  };
  put(4, FrameInterval(scene_->camera));
  put(18, static_cast<std::uint32_t>(scene_->camera.width * scene_->camera.height * 2));
  put(22, options_.isochronous ? kPacket : kBulkPayload);
  put(26, 48'000'000);
  return agreed;
}

UvcModel::Answer UvcModel::Streaming(const Request& request) {
  constexpr std::uint8_t kProbe = 0x01, kCommit = 0x02;
  if (request.entity != 0 || (request.selector != kProbe && request.selector != kCommit))
    return Refuse(kInvalidControl);
  if (request.code == 0x85) return Reply(LittleBytes(kProbeLength, 2));
  if (request.code == 0x86) return Reply({0x03});
  if (request.code != 0x01) {
    auto bytes = stream_;
    bytes.resize(std::min<std::size_t>(bytes.size(), request.length));
    return Reply(std::move(bytes));
  }
  if (request.out.size() < 26 || request.out.size() > kProbeLength) return Refuse(kInvalidRequest);
  std::vector<std::uint8_t> asked(request.out.begin(), request.out.end());
  asked.resize(kProbeLength);
  stream_ = Negotiated(asked);
  if (request.selector == kCommit) ++commits_;
  return Reply();
}

}  // namespace lensd::sim::devices
