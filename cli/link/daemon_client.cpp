// One conversation with the daemon: calls with their deadline, errors as exit statuses, Control-C as a stop.
#include "cli/link/daemon_client.h"

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "proto/errors_and_methods.h"
#include "proto/interfaces.h"

namespace lensd::cli {
namespace {

using varlink::Json;

std::string TextAt(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// The daemon's own words; the errors of Varlink itself have none.
std::string MessageOf(const varlink::Reply& refused) {
  if (std::string told = TextAt(refused.parameters, "message"); !told.empty()) return told;
  if (refused.error == varlink::kInterfaceNotFound) {
    return "the daemon has no interface '" + TextAt(refused.parameters, "interface") +
           "'; lensctl introspect says which it has";
  }
  if (refused.error == varlink::kMethodNotFound || refused.error == varlink::kMethodNotImplemented) {
    return "the daemon has no method '" + TextAt(refused.parameters, "method") +
           "'; lensctl introspect says which it has";
  }
  if (refused.error == varlink::kExpectedMore) return "this call answers several times: give --more";
  if (const std::string wrong = TextAt(refused.parameters, "parameter");
      refused.error == varlink::kInvalidParameter && !wrong.empty()) {
    return wrong == "more"
               ? "this call answers once: leave out --more"
               : "the parameter '" + wrong + "' is missing, unknown or of the wrong kind; see lensctl introspect";
  }
  return "the daemon answered " + refused.error + " " + varlink::WriteJson(refused.parameters);
}

/// Whether a method has a parameter for the key of a lease.
bool TakesLease(std::string_view method) {
  return std::ranges::any_of(proto::kMethods, [&](const proto::MethodRow& row) {
    return row.takes_lease && method.starts_with(row.interface) &&
           method.substr(row.interface.size()).starts_with('.') && method.substr(row.interface.size() + 1) == row.name;
  });
}

}  // namespace

/// Becomes readable on Control-C or SIGTERM while it lives; with `hang_up` also when the terminal goes, unless nohup
/// has that ignored.
class SignalWatch {
 public:
  explicit SignalWatch(bool hang_up = false) {
    sigset_t watched;
    sigemptyset(&watched);
    sigaddset(&watched, SIGINT);
    sigaddset(&watched, SIGTERM);
    struct sigaction on_hang_up{};
    if (hang_up && sigaction(SIGHUP, nullptr, &on_hang_up) == 0 && on_hang_up.sa_handler != SIG_IGN) {
      sigaddset(&watched, SIGHUP);
    }
    sigprocmask(SIG_BLOCK, &watched, &before_);
    descriptor_ = signalfd(-1, &watched, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~SignalWatch() {
    signalfd_siginfo taken;
    while (read(descriptor_, &taken, sizeof taken) > 0) continue;  // or it would strike when unblocked
    close(descriptor_);
    sigprocmask(SIG_SETMASK, &before_, nullptr);
  }
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  sigset_t before_;
  int descriptor_;
};

Json WithLease(std::string_view method, Json parameters) {
  const char* const key = std::getenv("LENSD_LEASE");
  if (key == nullptr || *key == 0 || parameters.contains("lease") || !TakesLease(method)) return parameters;
  parameters["lease"] = key;
  return parameters;
}

Failure FailureOf(const varlink::Reply& refused) {
  const auto* known = std::ranges::find(proto::kErrors, refused.error, &proto::ErrorRow::name);
  const Exit status = known == std::end(proto::kErrors) ? Exit::Protocol : Exit{known->exit_status};
  Failure failure(status, MessageOf(refused));
  if (refused.parameters.is_object()) failure.details = std::make_shared<Json>(refused.parameters);
  return failure;
}

std::string MethodOfLens(std::string_view method) {
  return std::string(proto::kLensInterface) + "." + std::string(method);
}

std::expected<DaemonClient, Failure> DaemonClient::Open(const Session& session) {
  const auto& globals = session.globals();
  const std::string path = globals.socket ? *globals.socket : std::string(proto::kDefaultSocket);
  auto client = varlink::Client::Connect(path);
  if (!client && access(path.c_str(), W_OK) != 0 && errno == EACCES) {
    return Refuse(Exit::NotPermitted, "you may not use the socket " + path + "; ask for membership of its group");
  }
  if (!client) return PassOn(client);
  return DaemonClient(*std::move(client), globals.timeout);
}

std::expected<Json, Failure> DaemonClient::Ask(std::string_view method, Json parameters, Duration patience) {
  client_.SetDeadline(MonotonicClock().Now() + timeout_.value_or(patience));
  auto reply = client_.Invoke(method, WithLease(method, std::move(parameters)));
  if (!reply && signals_ && reply.error().code == Code::Cancelled) {
    if (interrupted_) interrupted_();
    return Refuse(Exit::Interrupted, reply.error().message);
  }
  if (!reply) return PassOn(reply);
  if (!reply->error.empty()) return std::unexpected(FailureOf(*reply));
  return std::move(reply->parameters);
}

void DaemonClient::WatchSignals(std::function<void()> interrupted) {
  signals_ = std::make_shared<const SignalWatch>(true);
  interrupted_ = std::move(interrupted);
  client_.SetInterrupt(signals_->descriptor());
}

std::expected<Json, Failure> DaemonClient::Follow(std::string_view method, Json parameters, const Progress& progress,
                                                  const std::function<void()>& interrupted) {
  const auto signals = signals_ ? signals_ : std::make_shared<const SignalWatch>();
  // A descriptor that goes with this call must not be looked at by those after it.
  const struct Watching {
    varlink::Client& client;
    int after;
    ~Watching() { client.SetInterrupt(after); }
  } watching{client_, signals_ ? signals_->descriptor() : -1};
  client_.SetInterrupt(signals->descriptor());
  client_.SetDeadline(timeout_ ? std::optional(MonotonicClock().Now() + *timeout_) : std::nullopt);
  varlink::Call call;
  call.method = method;
  call.parameters = WithLease(method, std::move(parameters));
  call.more = progress != nullptr;
  if (auto sent = client_.Send(call); !sent) return PassOn(sent);
  for (;;) {
    auto reply = client_.Receive();
    const bool by_signal = !reply && reply.error().code == Code::Cancelled;
    const bool given_up = by_signal || (!reply && reply.error().code == Code::Timeout);
    if (given_up && interrupted) interrupted();
    if (given_up && !interrupted && interrupted_) interrupted_();
    if (by_signal) return Refuse(Exit::Interrupted, reply.error().message);
    if (!reply) return PassOn(reply);
    if (!reply->error.empty()) return std::unexpected(FailureOf(*reply));
    if (!reply->continues) return std::move(reply->parameters);
    if (!progress(reply->parameters)) return Json::object();
  }
}

}  // namespace lensd::cli
