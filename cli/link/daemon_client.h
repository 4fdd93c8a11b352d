// The daemon, as the commands see it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "cli/terminal/session.h"
#include "varlink/client.h"

namespace lensd::cli {

/// What an error of the daemon means for a person: its own message, and the status to end with.
Failure FailureOf(const varlink::Reply& refused);

/// How long a search for devices may take: buses one after the other, on a busy machine.
constexpr Duration kDeviceSearch = std::chrono::seconds(30);

class SignalWatch;

/// One connection to the daemon.
class DaemonClient {
 public:
  /// Connects to the session's socket, else to the built-in path.
  static std::expected<DaemonClient, Failure> Open(const Session& session);

  /// One call, one reply; waits --timeout, else `patience`.
  std::expected<varlink::Json, Failure> Ask(std::string_view method, varlink::Json parameters,
                                            Duration patience = std::chrono::seconds(10));

  /// Called for every reply before the last. False ends the call by closing the connection.
  using Progress = std::function<bool(const varlink::Json&)>;
  /// A call with `more`, unless `progress` is null; waits as long as it takes unless --timeout says otherwise, and
  /// returns the last reply. Control-C and SIGTERM end the wait: then `interrupted` is called, for instance to stop a
  /// lens, and the command fails.
  std::expected<varlink::Json, Failure> Follow(std::string_view method, varlink::Json parameters,
                                               const Progress& progress, const std::function<void()>& interrupted = {});

  /// For commands of many calls: from now on Control-C and SIGTERM strike at no other time than in a call, under way or
  /// next, which then fails as in `Follow`, after `interrupted` where it has none of its own.
  void WatchSignals(std::function<void()> interrupted);

 private:
  DaemonClient(varlink::Client client, std::optional<Duration> timeout)
      : client_(std::move(client)), timeout_(timeout) {}

  varlink::Client client_;
  std::optional<Duration> timeout_;
  std::shared_ptr<const SignalWatch> signals_;  ///< null: calls watch for themselves
  std::function<void()> interrupted_;
};

/// Adds the key of a lease, which $LENSD_LEASE hands from one command to the next, where the interface gives the method
/// a parameter `lease` and the caller has given none.
varlink::Json WithLease(std::string_view method, varlink::Json parameters);

/// The interface's methods by their short name.
std::string MethodOfLens(std::string_view method);

}  // namespace lensd::cli
