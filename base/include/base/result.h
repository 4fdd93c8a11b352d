// Results that carry either a value or one error that says what, why and what to do.
#pragma once

#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace lensd {

/// Why something could not be done. "No feasible plan" and "autofocus refused" are answers, not errors.
enum class Code {
  InvalidArgument,  ///< the request makes no sense as written
  OutOfRange,       ///< well formed, but outside what the device or the model allows
  Timeout,          ///< a deadline passed
  Cancelled,        ///< stopped by a person or a closing connection
  Superseded,       ///< a newer command for the same axis took over
  Disconnected,     ///< the device or the peer is not there
  WrongDevice,      ///< a device is there, but not the one that is meant
  Busy,             ///< something else is going on; try again
  Leased,           ///< another client alone may do that now
  NotHomed,         ///< an axis does not know where it stands: home it first
  Protocol,         ///< the other side broke the rules of its protocol
  Unsupported,      ///< this device cannot do that
  BadData,          ///< a file's contents are wrong
  Io,               ///< reading or writing failed
  NotKept,          ///< a file that the daemon keeps cannot be written
  Internal,         ///< our own fault
};

/// What an error knows for programs beside its message. Empty, or nothing: not known, or of no meaning here.
struct ErrorFacts {
  std::string axis{};               ///< of a lens: "focus"
  std::string parameter{};          ///< what was asked for, as the request calls it: "target.position"
  std::optional<double> minimum{};  ///< what would have been accepted, ends included
  std::optional<double> maximum{};
  std::string unit{};      ///< of these
  std::string activity{};  ///< what else is going on: "autofocus"
};

/// One error: a code for programs and one line for people.
struct Error {
  Code code = Code::Internal;
  std::string message;
  std::shared_ptr<const ErrorFacts> facts = nullptr;  ///< null: none
};

template <class T>
using Result = std::expected<T, Error>;

/// `return Fail(Code::Timeout, "…");` from any function that returns a Result.
[[nodiscard]] inline std::unexpected<Error> Fail(Code code, std::string message) {
  return std::unexpected(Error{code, std::move(message)});
}
/// The same with what programs want to know of it.
[[nodiscard]] inline std::unexpected<Error> Fail(Code code, std::string message, ErrorFacts facts) {
  return std::unexpected(Error{code, std::move(message), std::make_shared<const ErrorFacts>(std::move(facts))});
}

/// `if (!x) return PassOn(x);` passes the error of one Result on to a Result of another type.
template <class T, class E>
[[nodiscard]] std::unexpected<E> PassOn(const std::expected<T, E>& failed) {
  return std::unexpected(failed.error());
}
/// The same of an error that stands alone.
template <class E>
[[nodiscard]] std::unexpected<E> PassOn(E error) {
  return std::unexpected(std::move(error));
}

}  // namespace lensd
