// Calls in, replies out. Parameters are checked against the interface before any handler reads them.
#include "session.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "drivers/api/thread_barrier.h"
#include "proto/driver_interface.h"
#include "varlink/message.h"
#include "varlink/service_interface.h"

namespace lensd::drivers::host {
namespace {

using wire::Json;

constexpr Duration kReplyAtMost = std::chrono::seconds(10);

std::string Replied(const Json& parameters) {
  return varlink::EncodeReply(varlink::WriteJson(parameters), false);
}

std::string Refused(std::string_view error, Json parameters) {
  return varlink::EncodeReply({.parameters = std::move(parameters), .error = std::string(error), .continues = false});
}

/// org.varlink.service.
std::string AboutService(std::string_view method, const Json& parameters, std::string_view driver) {
  if (method == "GetInfo") {
    return Replied({{"vendor", "lensd"},
                    {"product", "lensd-driver " + std::string(driver)},
                    {"version", "1.0"},
                    {"url", "https://lensd.io"},
                    {"interfaces", Json::array({"org.varlink.service", proto::kDriverInterface})}});
  }
  if (method != "GetInterfaceDescription") {
    return Refused(varlink::kMethodNotFound, {{"method", "org.varlink.service." + std::string(method)}});
  }
  const auto asked = parameters.find("interface");
  if (asked == parameters.end() || !asked->is_string()) {
    return Refused(varlink::kInvalidParameter, {{"parameter", "interface"}});
  }
  if (*asked == proto::kDriverInterface) {
    return Replied({{"description", proto::DriverInterfaceText()}});
  }
  if (*asked == "org.varlink.service") {
    return Replied({{"description", varlink::ServiceInterfaceText()}});
  }
  return Refused(varlink::kInterfaceNotFound, {{"interface", *asked}});
}

/// "io.lensd.Driver.Read" into both halves.
std::pair<std::string_view, std::string_view> Halves(std::string_view method) {
  const std::size_t dot = method.rfind('.');
  if (dot == std::string_view::npos) return {"", method};
  return {method.substr(0, dot), method.substr(dot + 1)};
}

}  // namespace

Result<void> OpenDevices::Open(const std::string& name, const Settings& settings) {
  if (Find(name)) return Fail(Code::Busy, "a device named \"" + name + "\" is open already");
  auto opened = driver_.open(settings, clock_);
  if (!opened) return PassOn(opened);
  const std::lock_guard lock(mutex_);
  devices_[name] = std::make_shared<HostedDevice>(*std::move(opened));
  return {};
}

std::shared_ptr<HostedDevice> OpenDevices::Find(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(name);
  return found == devices_.end() ? nullptr : found->second;
}

void OpenDevices::Close(const std::string& name) {
  const std::shared_ptr<HostedDevice> device = Find(name);
  if (!device) return;
  device->Close();
  {
    // Not before it is closed: the process ends when none is left.
    const std::lock_guard lock(mutex_);
    devices_.erase(name);
  }
  if (const auto thrown = TakeContained()) std::fprintf(stderr, "closing: %s\n", thrown->c_str());
}

void OpenDevices::CloseAll() {
  std::vector<std::string> names;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, unused] : devices_) names.push_back(name);
  }
  Interrupt(names);
  for (const std::string& name : names) Close(name);
}

void OpenDevices::Interrupt(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (const auto device = Find(name)) device->Interrupt();
  }
}

Session::Session(daemon::Descriptor socket, OpenDevices& devices, const varlink::InterfaceDefinition& definition)
    : channel_(std::move(socket), varlink::kMaxMessageBytes), devices_(devices), definition_(definition) {}

void Session::Run() {
  for (;;) {
    const auto message = channel_.Next();
    if (!message) break;
    if (!*message) {
      if (!channel_.Receive(wire::Channel::Wait::Yes)) break;
      continue;
    }
    const auto reply = Answer(**message);
    if (!reply) {
      std::fprintf(stderr, "a connection is closed: %s\n", reply.error().message.c_str());
      break;
    }
    if (!reply->empty() && !channel_.Send(*reply, MonotonicClock().Now() + kReplyAtMost)) break;
  }
  std::vector<std::string> owned;
  {
    const std::lock_guard lock(mutex_);
    owned.swap(owned_);
  }
  for (const std::string& name : owned) devices_.Close(name);
}

void Session::OtherSideIsGone() {
  std::vector<std::string> owned;
  {
    const std::lock_guard lock(mutex_);
    owned = owned_;
  }
  devices_.Interrupt(owned);
}

Result<std::string> Session::Answer(std::string_view message) {
  const auto call = varlink::ReceiveCall(message);
  if (!call) return PassOn(call);
  if (call->upgrade) return Fail(Code::Protocol, "a call that asks for another protocol");
  const auto [interface, method] = Halves(call->method);
  const Json parameters = call->parameters.ToJson();
  std::string reply;
  if (interface == "org.varlink.service") {
    reply = AboutService(method, parameters, devices_.driver().name);
  } else if (const auto known = definition_.methods().find(method); interface != definition_.name()) {
    reply = Refused(varlink::kInterfaceNotFound, {{"interface", interface}});
  } else if (known == definition_.methods().end()) {
    reply = Refused(varlink::kMethodNotFound, {{"method", call->method}});
  } else if (const auto wrong = definition_.FirstWrong(*known->second.input, call->parameters)) {
    reply = Refused(varlink::kInvalidParameter, {{"parameter", *wrong}});
  } else {
    const auto done = Carry(method, parameters);
    reply = done ? Replied(*done) : Failure(method, parameters, done.error());
  }
  return call->oneway ? std::string() : reply;
}

Result<Json> Session::Carry(std::string_view method, const Json& parameters) {
  try {
    daemon::Descriptor passed = channel_.TakeDescriptor();
    if (method == "Search") return Search();
    if (method == "Open") return Open(parameters);
    const auto& name = parameters.at("device").get_ref<const std::string&>();
    const auto device = devices_.Find(name);
    if (!device) return Fail(Code::Disconnected, "no device named \"" + name + "\" is open");
    if (method != "Close") return device->Call(method, parameters, std::move(passed));
    devices_.Close(name);
    const std::lock_guard lock(mutex_);
    std::erase(owned_, name);
    return Json::object();
  } catch (...) {
    std::fprintf(stderr, "internal error in %.*s: %s\n", static_cast<int>(method.size()), method.data(),
                 CaughtText().c_str());
    throw;
  }
}

Result<Json> Session::Open(const Json& parameters) {
  const auto& name = parameters.at("device").get_ref<const std::string&>();
  const auto places = parameters.find("places");
  const auto settings = wire::SettingsFrom(parameters.at("settings"), places == parameters.end() ? Json() : *places);
  if (!settings) return PassOn(settings);
  if (auto opened = devices_.Open(name, *settings); !opened) return PassOn(opened);
  const std::lock_guard lock(mutex_);
  owned_.push_back(name);
  return Json::object();
}

Result<Json> Session::Search() {
  const Driver& driver = devices_.driver();
  if (driver.probe == nullptr) return Fail(Code::Unsupported, "devices of this driver cannot be searched for");
  const auto found = driver.probe();
  if (!found) return PassOn(found);
  Json list = Json::array();
  for (const FoundDevice& each : *found) list.push_back(wire::FoundJson(each));
  return Json{{"found", std::move(list)}};
}

std::string Session::Failure(std::string_view method, const Json& parameters, const Error& why) {
  Json json = wire::ErrorJson(why);
  const auto name = parameters.find("device");
  const bool of_the_lens = method == "Read" || method == "StartMove" || method == "StartHome" || method == "Stop";
  if (of_the_lens && name != parameters.end()) {
    if (const auto device = devices_.Find(name->get<std::string>())) json["busErrors"] = device->bus_errors();
  }
  return Refused(std::string(proto::kDriverInterface) + ".Failed", std::move(json));
}

}  // namespace lensd::drivers::host
