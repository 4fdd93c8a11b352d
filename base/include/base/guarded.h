// The wall at the end of every thread: what throws there ends one lens or one call, never the daemon.
#pragma once

#include <exception>
#include <optional>
#include <string>

#include "base/result.h"

namespace lensd {

/// Runs `work`; what it threw, as an error that says who was at it.
template <class Work>
std::optional<Error> Guarded(const std::string& who, Work&& work) {
  try {
    work();
    return std::nullopt;
  } catch (const std::exception& failure) {
    return Error{Code::Internal, "internal error in " + who + ": " + failure.what()};
  } catch (...) {
    return Error{Code::Internal, "internal error in " + who};
  }
}

}  // namespace lensd
