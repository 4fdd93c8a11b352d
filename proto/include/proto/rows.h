// What a row of proto/errors_and_methods.md is in C++; the rows themselves are in proto/errors_and_methods.h, which is
// generated while building.
#pragma once

#include <string_view>

#include "base/result.h"

namespace lensd::proto {

/// Who may call a method. Each includes those before it. Every client that may connect may observe, and stop what
/// moves.
enum class Role { Observe, Move, Administer };
/// Whether a lease keeps everybody but its holder from calling a method. ToApply: where its parameter `apply` is true.
/// ToChange: it changes what is kept of a lens and moves nothing, so that no stop stands against it.
enum class NeedsLease { No, Yes, ToApply, ToChange };
/// Whether a call may change a lens or what is kept of it. A oneway call of a method that may not is skipped: nobody
/// would see its answer.
enum class MayChangeState { No, Yes };
/// Whether a call may be made with `more`, or must be.
enum class Streams { No, Yes, Only };

struct ErrorRow {
  std::string_view name;  ///< with its interface
  int exit_status;        ///< of lensctl
  int http;               ///< status that lens-web answers with
  int lens_run;           ///< exit status of lens-run; 0: it never meets this error
};

struct ExitWord {
  int status;
  std::string_view word;
};

struct MethodRow {
  std::string_view interface;
  std::string_view name;  ///< without its interface
  Role role;
  NeedsLease needs_lease;
  MayChangeState may_change_state;
  Streams streams;
  bool takes_lease;  ///< it has a parameter for the key of a lease
};

}  // namespace lensd::proto
