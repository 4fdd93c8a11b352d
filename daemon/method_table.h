// What a service says of each of its methods: who serves it, and what a call of it may do.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "access.h"
#include "exchange.h"

namespace lensd::daemon {

/// Whether a lease keeps everybody but its holder from calling a method. ToApply: where its parameter `apply` is true.
/// ToChange: it changes what is kept of a lens and moves nothing, so that no stop stands against it.
enum class NeedsLease { No, Yes, ToApply, ToChange };
/// Whether a call may change a lens or what is kept of it. One that may not is nothing without an answer.
enum class MayChangeState { No, Yes };

/// Whether a call waits for those of its connection before it, or acts as soon as it is read (its reply waits anyway).
enum class Acts { InTurn, WhenRead };

/// Whether a call may be made with `more`, or must be.
enum class Streams { No, Yes, Only };

/// One row.
struct Method {
  std::string_view name;
  /// Serves one call now or later; the parameters match the definition.
  std::function<void(const ExchangePointer&)> serve;
  NeedsLease needs_lease = NeedsLease::No;
  MayChangeState may_change_state = MayChangeState::No;
  Acts acts = Acts::InTurn;
  Streams streams = Streams::No;
  /// Whose call is served. ToApply: observers may call it where it applies nothing.
  Role role = may_change_state == MayChangeState::Yes ? Role::Move : Role::Observe;
  /// Name of a parameter that makes a call one of administrators where it is true; empty: none.
  std::string_view administers = {};
};
using MethodTable = std::vector<Method>;

}  // namespace lensd::daemon
