// Who alone may move a lens, and until when.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "loop/event_loop.h"
#include "varlink/json.h"

namespace lensd::daemon {

struct Lease {
  std::string key;
  std::string holder;            ///< who took it or renewed it last, for people
  const void* owner = nullptr;   ///< the connection that took it, while that is open
  std::optional<Instant> until;  ///< when it ends; none: with that connection
};

/// LeaseInfo, or null where there is none.
varlink::Json LeaseJson(const Lease* lease);

/// The lease of one lens. Event loop thread only.
class LensLease {
 public:
  /// Hears a LeaseChange once it is so; what ended it is past.
  using Told = std::function<void(const varlink::Json& change)>;
  enum class End { Dropped, Expired, Disconnected, Reopened };

  LensLease(EventLoop& loop, const Clock& clock, Told told);

  /// Null: none holds.
  const Lease* now() const;
  /// Takes it where none holds, and renews it where one does; a client that may not has been told so before.
  void Take(Lease lease);
  /// A connection has closed: what it took without a time ends, and the rest is its key's.
  void Left(const void* owner);
  /// Harmless where there is none.
  void Drop(End cause);
  /// The lens is opened anew: the lease that held of it before goes on here, with its key, its holder and its end.
  void GoOnFrom(LensLease& before);

 private:
  void Expire();
  void Tell(const Lease& lease, std::string_view change, std::string_view cause);

  const Clock& clock_;
  const Told told_;
  Alarm alarm_;
  std::optional<Lease> lease_;  // it may be over: now() says
};

}  // namespace lensd::daemon
