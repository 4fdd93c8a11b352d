// How calls are refused: every error of the interface with its message and with what is known for programs.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "base/result.h"
#include "daemon/server/exchange.h"

namespace lensd::daemon {

class ServedLens;

/// Ends a call with an error.
void Refuse(const ExchangePointer& exchange, const Error& error);
/// The same with one that concerns this lens. Busy says whose call it waits for, and since when that goes on.
void Refuse(const ExchangePointer& exchange, const ServedLens& lens, const Error& error);

/// A request that makes no sense as written: which parameter is wrong, by its path, and what it may be.
inline Error Wrong(std::string message, ErrorFacts facts) {
  return Fail(Code::InvalidArgument, std::move(message), std::move(facts)).error();
}
/// An error with the parameter that it is about, unless it names one itself.
Error About(std::string parameter, const Error& error);
/// The same, whatever it names.
Error Renamed(std::string parameter, const Error& error);

}  // namespace lensd::daemon
