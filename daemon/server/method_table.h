// What a service says of each of its methods: who serves it, and what a call of it may do.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "daemon/server/access.h"
#include "daemon/server/exchange.h"
#include "proto/rows.h"

namespace lensd::daemon {

using proto::MayChangeState;
using proto::NeedsLease;
using proto::Streams;

/// Whether a call waits for those of its connection before it, or acts as soon as it is read (its reply waits anyway).
enum class Acts { InTurn, WhenRead };

/// One method. What proto/errors_and_methods.md says of it is filled in by Described().
struct Method {
  std::string_view name;
  /// Serves one call now or later; the parameters match the definition.
  std::function<void(const ExchangePointer&)> serve;
  Acts acts = Acts::InTurn;
  /// Name of a parameter that makes a call one of administrators where it is true; empty: none.
  std::string_view administers = {};
  NeedsLease needs_lease = NeedsLease::No;
  MayChangeState may_change_state = MayChangeState::No;
  Streams streams = Streams::No;
  /// Whose call is served. ToApply: observers may call it where it applies nothing.
  Role role = Role::Observe;
};
using MethodTable = std::vector<Method>;

/// These methods of an interface with what proto/errors_and_methods.md says of each. A method without a row there is
/// our own bug and ends the program.
MethodTable Described(std::string_view interface, MethodTable methods);

}  // namespace lensd::daemon
