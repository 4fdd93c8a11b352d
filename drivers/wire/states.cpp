// What changes while a device is open: positions, frames, counts; and errors.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/wire/wire.h"
#include "fields.h"
#include "words.h"

namespace lensd::drivers::wire {
namespace {

constexpr std::int64_t kMostCount = INT64_MAX;

constexpr std::array<std::pair<Code, std::string_view>, 13> kCodes = {{{Code::InvalidArgument, "invalidArgument"},
                                                                       {Code::OutOfRange, "outOfRange"},
                                                                       {Code::Timeout, "timeout"},
                                                                       {Code::Cancelled, "cancelled"},
                                                                       {Code::Disconnected, "disconnected"},
                                                                       {Code::WrongDevice, "wrongDevice"},
                                                                       {Code::Busy, "busy"},
                                                                       {Code::NotHomed, "notHomed"},
                                                                       {Code::Protocol, "protocol"},
                                                                       {Code::Unsupported, "unsupported"},
                                                                       {Code::BadData, "badData"},
                                                                       {Code::Io, "io"},
                                                                       {Code::Internal, "internal"}}};

std::int64_t Nanoseconds(Instant at) {
  return at.time_since_epoch().count();
}

std::uint64_t Count(Fields& read, std::string_view key) {
  return static_cast<std::uint64_t>(read.Integer(key, 0, kMostCount));
}

}  // namespace

std::string_view CodeWord(Code code) {
  const auto found = std::ranges::find(kCodes, code, &std::pair<Code, std::string_view>::first);
  return found == kCodes.end() ? "internal" : found->second;
}

Code CodeFromWord(std::string_view word) {
  const auto found = std::ranges::find(kCodes, word, &std::pair<Code, std::string_view>::second);
  return found == kCodes.end() ? Code::Internal : found->first;
}

double Milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

Duration FromMilliseconds(double ms) {
  return Duration(std::llround(ms * 1e6));
}

Json StateJson(const LensState& state) {
  Json axes = Json::array();
  for (const Axis axis : kAxes) {
    if (!state.axes[axis]) continue;
    const AxisState& is = *state.axes[axis];
    Json json{{"axis", AxisName(axis)}, {"position", varlink::NumberOrNull(is.position.value)}, {"moving", is.moving}};
    if (!is.homed) json["homed"] = false;
    if (is.assumed) json["assumed"] = true;
    if (is.waiting) json["waiting"] = true;
    if (!is.fault.empty()) json["fault"] = is.fault;
    axes.push_back(std::move(json));
  }
  Json json{{"sampledAtNs", Nanoseconds(state.sampled_at)}, {"axes", std::move(axes)}};
  if (state.temperature) json["temperatureC"] = varlink::NumberOrNull(state.temperature->value);
  return json;
}

Result<LensState> StateFrom(const Json& json, const Capabilities& can, Instant now) {
  Fields read(json, "the reading");
  LensState state;
  state.sampled_at = std::min(Instant{Duration{read.IntegerOr("sampledAtNs", Nanoseconds(now), 0, kMostCount)}}, now);
  if (const auto celsius = read.MaybeNumber("temperatureC", -300.0, 1e4)) state.temperature = Celsius{*celsius};
  for (const Json& one : read.Elements("axes")) {
    Fields from(one, "axes");
    const Axis axis = kAxes[from.Word("axis", AxisWords())];
    AxisState is;
    is.position = Native{from.Number("position", -kAnyNumber, kAnyNumber)};
    is.moving = from.Flag("moving");
    is.homed = from.FlagOr("homed", true);
    is.assumed = from.FlagOr("assumed", false);
    is.waiting = from.FlagOr("waiting", false);
    is.fault = from.TextOr("fault", "");
    read.Take(from.Finish());
    if (can.axes[axis]) state.axes[axis] = std::move(is);
  }
  for (const Axis axis : kAxes) {
    if (can.axes[axis] && !state.axes[axis]) read.Reject("axes", "lacks " + std::string(AxisName(axis)));
  }
  if (auto done = read.Finish(); !done) return PassOn(done);
  return state;
}

Json CountersJson(const Counters& counters) {
  return {{"frames", counters.frames},
          {"framesLost", counters.frames_lost},
          {"framesLate", counters.frames_late},
          {"packetsLost", counters.packets_lost},
          {"packetsResent", counters.packets_resent},
          {"framesDamaged", counters.frames_damaged},
          {"framesFlawed", counters.frames_flawed},
          {"busErrors", counters.bus_errors}};
}

Result<Counters> CountersFrom(const Json& json) {
  Fields read(json, "counters");
  Counters counters;
  counters.frames = Count(read, "frames");
  counters.frames_lost = Count(read, "framesLost");
  counters.frames_late = Count(read, "framesLate");
  counters.packets_lost = Count(read, "packetsLost");
  counters.packets_resent = Count(read, "packetsResent");
  counters.frames_damaged = Count(read, "framesDamaged");
  counters.frames_flawed = Count(read, "framesFlawed");
  counters.bus_errors = Count(read, "busErrors");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return counters;
}

Json UnusableJson(const UnusableFrames& unusable) {
  return {{"count", unusable.count}, {"why", unusable.why}};
}

Result<UnusableFrames> UnusableFrom(const Json& json) {
  Fields read(json, "unusable");
  UnusableFrames unusable;
  unusable.count = static_cast<int>(read.Integer("count", 0, INT32_MAX));
  unusable.why = read.TextOr("why", "");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return unusable;
}

Json ExposureJson(const ExposureState& state) {
  Json json = Json::object();
  if (state.exposure) json["exposureMs"] = Milliseconds(*state.exposure);
  if (state.gain) json["gain"] = varlink::NumberOrNull(*state.gain);
  return json;
}

Result<ExposureState> ExposureFrom(const Json& json) {
  Fields read(json, "the exposure");
  ExposureState state;
  if (const auto ms = read.MaybeNumber("exposureMs", 0.0, 1e9)) state.exposure = FromMilliseconds(*ms);
  state.gain = read.MaybeNumber("gain", -kAnyNumber, kAnyNumber);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return state;
}

Json FrameJson(const Frame& frame) {
  return {{"widthPx", frame.width},
          {"heightPx", frame.height},
          {"bits", frame.bits},
          {"gamma", frame.gamma},
          {"sequence", frame.sequence},
          {"exposureStartNs", Nanoseconds(frame.exposure_start)},
          {"exposureEndNs", Nanoseconds(frame.exposure_end)},
          {"colour", frame.colour != nullptr}};
}

Result<Frame> FrameFrom(const Json& json, const CameraCapabilities& can, Instant now) {
  Fields read(json, "frame");
  Frame frame;
  frame.width = static_cast<int>(read.Integer("widthPx", can.width, can.width));
  frame.height = static_cast<int>(read.Integer("heightPx", can.height, can.height));
  frame.bits = static_cast<int>(read.Integer("bits", can.bits, can.bits));
  frame.gamma = read.NumberOr("gamma", 1.0, 0.01, 100.0);
  frame.sequence = static_cast<std::uint64_t>(read.Integer("sequence", 0, kMostCount));
  const auto end = Instant{Duration{read.Integer("exposureEndNs", 0, kMostCount)}};
  const auto start = Instant{Duration{read.Integer("exposureStartNs", 0, kMostCount)}};
  if (start > end) read.Reject("exposureStartNs", "is after exposureEndNs");
  frame.exposure_end = std::min(end, now);
  frame.exposure_start = std::min(start, now);
  if (auto done = read.Finish(); !done) return PassOn(done);
  return frame;
}

bool FrameHasColour(const Json& json) {
  return Fields(json, "frame").FlagOr("colour", false);
}

Json ErrorJson(const Error& error) {
  return {{"code", CodeWord(error.code)}, {"message", error.message}};
}

Error ErrorFrom(const Json& parameters) {
  Fields read(parameters, "the error");
  const Code code = CodeFromWord(read.TextOr("code", "internal"));
  return {code, read.TextOr("message", "the driver did not say why")};
}

}  // namespace lensd::drivers::wire
