// One call being served, from the moment it is understood to its last reply.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/server/access.h"
#include "loop/descriptor.h"
#include "varlink/message.h"

namespace lensd::daemon {

class Connection;

/// Event loop thread only. Replies to a oneway call, or to a peer that is gone, are dropped silently. A handler that
/// serves the call keeps it alive until Finish() or Refuse().
class Exchange : public std::enable_shared_from_this<Exchange> {
 public:
  /// `connection` is null for oneway calls; `number` counts all calls in the order they were read.
  Exchange(varlink::ReceivedCall call, Connection* connection, std::shared_ptr<const Credentials> credentials,
           std::uint64_t number)
      : call_(std::move(call)),
        connection_(connection),
        peer_(connection),
        credentials_(std::move(credentials)),
        number_(number) {}

  const varlink::ReceivedCall& call() const { return call_; }
  /// The parameters as they were parsed; an object.
  varlink::JsonView view() const { return call_.parameters; }
  /// The same as a Json, made when first asked for.
  const varlink::Json& parameters() const;
  /// Whether a parameter is there and true.
  bool Asks(std::string_view parameter) const {
    const auto given = view().Given(parameter);
    return given && given->boolean();
  }

  /// One of several replies; the call must have been made with `more`. `parameters` is a JSON object.
  void Continue(std::string_view parameters);
  /// The same with an open file, which the client receives with the first byte of the reply (SCM_RIGHTS).
  void Continue(std::string_view parameters, Descriptor file);
  /// The last reply.
  void Finish(std::string_view parameters);
  /// The last reply, an error.
  void Refuse(std::string_view error, varlink::Json parameters);

  /// Called at most once, when the peer goes before the last reply.
  void OnGone(std::move_only_function<void()> gone) { gone_ = std::move(gone); }
  std::uint64_t number() const { return number_; }
  /// Bytes sent to this client that it has not read yet.
  std::size_t unread() const;
  /// Which client called: equal for calls of one connection that is still open; null for oneway calls.
  const void* peer() const { return peer_; }
  /// Which connection it came by, oneway calls too: to compare only.
  const void* client() const { return credentials_.get(); }
  const Credentials& credentials() const { return *credentials_; }
  /// The program and the user behind the client, for people: "lensctl[4711] of user 1000".
  std::string caller() const;
  /// Called when the client's connection closes, also after the last reply; once, from the event loop. An empty
  /// function forgets what was left under `key`.
  void AtClose(std::uint64_t key, std::move_only_function<void()> closed);

  /// Called whenever the peer has read everything sent so far, until the last reply.
  void OnDrained(std::move_only_function<void()> drained) { drained_ = std::move(drained); }

 private:
  friend class Connection;
  void PeerGone();
  void SendLast(std::string message);
  void PeerDrained();

  varlink::ReceivedCall call_;
  mutable std::optional<varlink::Json> parameters_;
  Connection* connection_;
  const void* peer_;  // outlives connection_, to compare only
  const std::shared_ptr<const Credentials> credentials_;
  const std::uint64_t number_;
  bool in_turn_ = true;              // replies may go out; otherwise the last one is held until then
  std::optional<std::string> held_;  // the last reply
  std::move_only_function<void()> ended_;
  std::move_only_function<void()> gone_;
  std::move_only_function<void()> drained_;
};
using ExchangePointer = std::shared_ptr<Exchange>;

}  // namespace lensd::daemon
