// A call that is interrupted gets a moment for its own answer, since the process was asked to end it; then its reply is
// passed over when it comes. A Read that is cut short gets none, because a stop waits behind it.
#include "remote.h"

#include <algorithm>
#include <utility>

#include "proto/driver_interface.h"
#include "varlink/service_interface.h"

namespace lensd::drivers::process {
namespace {

using wire::Json;

constexpr Duration kInterruptedAtMost = std::chrono::milliseconds(100);
constexpr Duration kCloseAtMost = std::chrono::seconds(4);
constexpr std::string_view kFailed = "io.lensd.Driver.Failed";

std::string NewName() {
  static std::atomic<std::uint64_t> count = 0;
  return "device-" + std::to_string(++count);
}

std::string InSeconds(Duration duration) {
  const std::string number = varlink::WriteJson(std::chrono::duration<double>(duration).count());
  return (number.ends_with(".0") ? number.substr(0, number.size() - 2) : number) + " s";
}

}  // namespace

Remote::Remote(const Program& program, std::shared_ptr<SharedProcess> shared, SharedProcess::Connected connected)
    : program_(program),
      shared_(std::move(shared)),
      process_(std::move(connected.process)),
      device_(NewName()),
      lens_(std::make_unique<Link>(std::move(connected.connections[0]))),
      camera_(std::make_unique<Link>(std::move(connected.connections[1]))),
      urgent_(std::make_unique<Urgent>(std::make_unique<Link>(std::move(connected.connections[2])), device_)) {
  if (program_.runs) program_.runs(process_->process(), true);
}

Result<std::shared_ptr<Remote>> Remote::Open(const Program& program, const Settings& settings) {
  auto sent = wire::SettingsJson(settings);
  if (!sent) return PassOn(sent);
  auto shared = SharedProcess::For(program);
  auto connected = shared->Connect(program);
  if (!connected) return PassOn(connected);
  std::shared_ptr<Remote> remote(new Remote(program, std::move(shared), *std::move(connected)));
  auto opened =
      remote->Call(By::Lens, "Open", {{"settings", std::move(sent->values)}, {"places", std::move(sent->places)}});
  if (!opened) return PassOn(opened);
  return remote;
}

Remote::~Remote() {
  if (program_.runs) program_.runs(process_->process(), false);
  if (!lost_) {
    const Instant deadline = MonotonicClock().Now() + kCloseAtMost;
    const auto number = lens_->Send("Close", {{"device", device_}}, deadline);
    if (!number || !lens_->Receive(*number, deadline, -1)) process_->Kill();
  }
  shared_->LeaveBy([this] {
    lens_.reset();
    camera_.reset();
    urgent_.reset();
    process_.reset();
  });
}

Result<std::unique_ptr<Link>> Remote::ConnectForColours() const {
  auto socket = process_->Connect();
  if (!socket) return PassOn(socket);
  return std::make_unique<Link>(*std::move(socket));
}

Result<Json> Remote::Call(By by, std::string_view method, Json parameters, int pass) {
  const std::lock_guard calling(calling_);
  if (lost_) return PassOn(*lost_);
  if (by != By::Urgent) {
    auto settled = urgent_->Settle(MonotonicClock().Now() + program_.call_at_most);
    if (!settled) return Judge(method, PassOn(settled), program_.call_at_most);
  }
  const Duration at_most = method == "Open" ? program_.open_at_most : program_.call_at_most;
  parameters["device"] = device_;
  urgent_->Begin(method == "Read");
  auto reply = Converse(by, method, std::move(parameters), pass, MonotonicClock().Now() + at_most);
  urgent_->End();
  return Judge(method, std::move(reply), at_most);
}

Result<varlink::Reply> Remote::Converse(By by, std::string_view method, Json parameters, int pass, Instant deadline) {
  Link& link = by == By::Lens ? *lens_ : by == By::Camera ? *camera_ : urgent_->link();
  const auto number = by == By::Urgent ? urgent_->Send(method, std::move(parameters), deadline)
                                       : link.Send(method, std::move(parameters), deadline, pass);
  // What it replied before it closed says more.
  if (!number && number.error().code != Code::Disconnected) return PassOn(number);
  auto reply = link.Receive(number.value_or(link.sent()), deadline, urgent_->wake());
  if (reply || reply.error().code != Code::Cancelled || !urgent_->interrupted()) return reply;
  const Instant patience = MonotonicClock().Now() + kInterruptedAtMost;
  reply = link.Receive(number.value_or(link.sent()), std::min(deadline, patience), -1);
  if (!reply && reply.error().code == Code::Timeout) return Fail(Code::Cancelled, "interrupted");
  return reply;
}

Result<Json> Remote::Judge(std::string_view method, Result<varlink::Reply> reply, Duration after) {
  const std::string name(method);
  if (!reply) {
    switch (reply.error().code) {
      case Code::Cancelled:
      case Code::BadData:
        return PassOn(reply);
      case Code::Timeout:
        return PassOn(Lose(process_->EndBecause("the driver has not answered for " + InSeconds(after) + " in " + name +
                                                ", and was ended")));
      case Code::Protocol:
        return PassOn(Lose(process_->EndBecause("the driver broke the rules of Varlink in " + name + " (" +
                                                reply.error().message + "), and was ended")));
      default:
        return PassOn(Lose(process_->HowItEnded(method)));
    }
  }
  const auto errors = reply->parameters.find("busErrors");
  if (errors != reply->parameters.end() && errors->is_number_unsigned()) {
    bus_errors_ = std::max<std::uint64_t>(bus_errors_, errors->get<std::uint64_t>());
  }
  if (reply->error.empty()) return std::move(reply->parameters);
  if (reply->error == kFailed) return PassOn(wire::ErrorFrom(reply->parameters));
  if (reply->error == varlink::kMethodNotFound || reply->error == varlink::kMethodNotImplemented) {
    return Fail(Code::Unsupported, "this driver has no " + name);
  }
  CountWrongReply();
  return Fail(Code::Protocol, "the driver answered " + name + " with " + reply->error.substr(0, 200));
}

Error Remote::Lose(Error why) {
  lost_ = std::move(why);
  return *lost_;
}

}  // namespace lensd::drivers::process
