// Each call of the interface is one call of drivers/api.
#include "hosted_device.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <span>

#include "drivers/api/thread_barrier.h"
#include "varlink/base64.h"

namespace lensd::drivers::host {
namespace {

using wire::Json;

constexpr std::size_t kColoursKept = 4;
/// A call that has begun, and does not wait yet, does not notice that it was asked to end: it is asked again.
constexpr auto kAskAgainAfter = std::chrono::milliseconds(5);

Axis AxisOf(const Json& parameters) {
  return *AxisFromName(parameters.at("axis").get_ref<const std::string&>());
}

Result<Json> Answered(const Result<void>& done) {
  if (!done) return PassOn(done);
  return Json::object();
}

std::int64_t NumberIn(const Json& parameters, const char* key) {
  const auto found = parameters.find(key);
  return found == parameters.end() || found->is_null() ? -1 : found->get<std::int64_t>();
}

}  // namespace

HostedDevice::Handler HostedDevice::HandlerOf(std::string_view method) {
  static constexpr std::array<std::pair<std::string_view, Handler>, 10> kHandlers = {{
      {"Describe", &HostedDevice::Describe},
      {"StartHome", &HostedDevice::StartHome},
      {"StartMove", &HostedDevice::StartMove},
      {"Read", &HostedDevice::Read},
      {"ResetFault", &HostedDevice::ResetFault},
      {"NextFrame", &HostedDevice::NextFrame},
      {"StopStream", &HostedDevice::StopStream},
      {"SetExposure", &HostedDevice::SetExposure},
      {"SetGain", &HostedDevice::SetGain},
      {"GetExposure", &HostedDevice::GetExposure},
  }};
  const auto found = std::ranges::find(kHandlers, method, &std::pair<std::string_view, Handler>::first);
  return found == kHandlers.end() ? nullptr : found->second;
}

Result<Json> HostedDevice::Call(std::string_view method, const Json& parameters, daemon::Descriptor passed) {
  if (method == "Interrupt") return Interrupt(), Json::object();
  if (method == "CutReadShort") return CutReadShort(), Json::object();
  if (method == "Colour") return Colour(parameters);
  if (method == "Stop") {
    const auto turn = TurnAfter(&HostedDevice::CutReadShort);
    return Stop(parameters);
  }
  const std::lock_guard lock(calls_);
  if (method == "StartStream") return StartStream(parameters, std::move(passed));
  const Handler handler = HandlerOf(method);
  if (handler == nullptr) return Fail(Code::Unsupported, "this driver has no method " + std::string(method));
  return (this->*handler)(parameters);
}

void HostedDevice::Interrupt() {
  const std::lock_guard lock(open_);
  if (device_.lens) device_.lens->Interrupt();
  if (device_.camera) device_.camera->Interrupt();
}

void HostedDevice::CutReadShort() {
  const std::lock_guard lock(open_);
  if (device_.lens) device_.lens->CutReadShort();
}

std::unique_lock<std::timed_mutex> HostedDevice::TurnAfter(void (HostedDevice::*ask_to_end)()) {
  std::unique_lock turn(calls_, std::try_to_lock);
  while (!turn.owns_lock()) {
    (this->*ask_to_end)();
    (void)turn.try_lock_for(kAskAgainAfter);
  }
  return turn;
}

void HostedDevice::Close() {
  std::call_once(closing_, [this] {
    const auto turn = TurnAfter(&HostedDevice::Interrupt);
    Device closed;
    {
      const std::lock_guard open(open_);  // from now on nothing interrupts it
      std::swap(closed, device_);
    }
    const std::lock_guard pictures(pictures_);
    colours_.clear();
    closed = {};
  });
}

std::uint64_t HostedDevice::bus_errors() {
  const std::lock_guard lock(calls_);
  return device_.lens ? device_.lens->bus_errors() : 0;
}

Result<Lens*> HostedDevice::TheLens() const {
  if (device_.lens) return device_.lens.get();
  if (!device_.camera) return Fail(Code::Disconnected, "the device is closed");
  return Fail(Code::Unsupported, "this device has no lens");
}

Result<Camera*> HostedDevice::TheCamera() const {
  if (device_.camera) return device_.camera.get();
  if (!device_.lens) return Fail(Code::Disconnected, "the device is closed");
  return Fail(Code::Unsupported, "this device has no camera");
}

Result<Json> HostedDevice::Describe(const Json&) {
  return wire::DescriptionJson(device_);
}

Result<Json> HostedDevice::StartHome(const Json& parameters) {
  const auto lens = TheLens();
  return lens ? Answered((*lens)->StartHome(AxisOf(parameters))) : PassOn(lens);
}

Result<Json> HostedDevice::StartMove(const Json& parameters) {
  const auto lens = TheLens();
  if (!lens) return PassOn(lens);
  return Answered((*lens)->StartMove(AxisOf(parameters), Native{parameters.at("target").get<double>()}));
}

Result<Json> HostedDevice::Read(const Json&) {
  const auto lens = TheLens();
  if (!lens) return PassOn(lens);
  const auto state = (*lens)->Read();
  if (!state) return PassOn(state);
  Json json = wire::StateJson(*state);
  json["busErrors"] = (*lens)->bus_errors();
  return json;
}

Result<Json> HostedDevice::Stop(const Json& parameters) {
  const auto lens = TheLens();
  return lens ? Answered((*lens)->Stop(AxisOf(parameters))) : PassOn(lens);
}

Result<Json> HostedDevice::ResetFault(const Json& parameters) {
  const auto lens = TheLens();
  return lens ? Answered((*lens)->ResetFault(AxisOf(parameters))) : PassOn(lens);
}

Result<Json> HostedDevice::StartStream(const Json& parameters, daemon::Descriptor passed) {
  const auto camera = TheCamera();
  if (!camera) return PassOn(camera);
  MemorySlots slots;
  if (passed) {
    auto mapped = MemorySlots::Map(passed, NumberIn(parameters, "slots"), NumberIn(parameters, "slotBytes"));
    if (!mapped) return PassOn(mapped);
    slots = *std::move(mapped);
  }
  if (auto started = (*camera)->Start(); !started) return PassOn(started);
  const std::lock_guard lock(pictures_);
  slots_ = std::move(slots);
  return Json{{"slots", slots_.mapped()}};
}

Result<void> HostedDevice::Put(const std::vector<std::uint16_t>& samples, const Json& parameters, Json& into) {
  const std::int64_t slot = NumberIn(parameters, "slot");
  if (slot >= 0) {
    const std::lock_guard lock(pictures_);
    return slots_.Write(slot, samples);
  }
  // Little-endian machines alone have our drivers: in memory the low byte is first.
  into["samples"] = varlink::EncodeBase64(
      {reinterpret_cast<const std::uint8_t*>(samples.data()), samples.size() * sizeof(std::uint16_t)});
  return {};
}

Result<Json> HostedDevice::NextFrame(const Json& parameters) {
  const auto camera = TheCamera();
  if (!camera) return PassOn(camera);
  const auto frame = (*camera)->Poll();
  if (!frame) return PassOn(frame);
  Json json{{"counters", wire::CountersJson((*camera)->counters())},
            {"unusable", wire::UnusableJson((*camera)->unusable())}};
  if (!*frame) return json;
  json["frame"] = wire::FrameJson(**frame);
  if (auto put = Put(*(*frame)->samples, parameters, json["frame"]); !put) return PassOn(put);
  if (!(*frame)->colour) return json;
  const std::lock_guard lock(pictures_);
  colours_.emplace_back((*frame)->sequence, (*frame)->colour);
  if (colours_.size() > kColoursKept) colours_.pop_front();
  return json;
}

Result<Json> HostedDevice::Colour(const Json& parameters) {
  const auto sequence = parameters.at("sequence").get<std::uint64_t>();
  ColourMaker make;
  {
    const std::lock_guard lock(pictures_);
    const auto found = std::ranges::find(colours_, sequence, &std::pair<std::uint64_t, ColourMaker>::first);
    if (found != colours_.end()) make = found->second;
  }
  const auto samples = make ? make() : nullptr;
  Json json{{"found", samples != nullptr}};
  if (!samples) return json;
  if (auto put = Put(*samples, parameters, json); !put) return PassOn(put);
  return json;
}

Result<Json> HostedDevice::StopStream(const Json&) {
  const auto camera = TheCamera();
  return camera ? Answered((*camera)->Stop()) : PassOn(camera);
}

Result<Json> HostedDevice::SetExposure(const Json& parameters) {
  const auto camera = TheCamera();
  if (!camera) return PassOn(camera);
  return Answered((*camera)->SetExposure(wire::FromMilliseconds(parameters.at("exposureMs").get<double>())));
}

Result<Json> HostedDevice::SetGain(const Json& parameters) {
  const auto camera = TheCamera();
  return camera ? Answered((*camera)->SetGain(parameters.at("gain").get<double>())) : PassOn(camera);
}

Result<Json> HostedDevice::GetExposure(const Json&) {
  const auto camera = TheCamera();
  if (!camera) return PassOn(camera);
  const auto state = (*camera)->ReadExposure();
  if (!state) return PassOn(state);
  return wire::ExposureJson(*state);
}

}  // namespace lensd::drivers::host
