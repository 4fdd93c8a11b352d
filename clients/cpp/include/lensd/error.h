// The one exception of liblensd.
#ifndef LENSD_ERROR_H_
#define LENSD_ERROR_H_

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "lensd/value.h"

namespace lensd {
inline namespace v1 {

/// What went wrong: what() is one line for people (what, why, what to do), the rest is for programs; nullopt or ""
/// where nothing is known. One class for every error, told apart by name(): lensd may get more of them.
class LENSD_API LensdError : public std::runtime_error {
 public:
  /// `fields`: as JSON, what lensd told beside the message.
  LensdError(const std::string& name, const std::string& message, const std::string& fields = "{}");
  LensdError(const LensdError&);
  LensdError& operator=(const LensdError&);
  ~LensdError() override;

  /// As in docs/interface.md ("OutOfRange"); of errors that no lensd answered with one of: "Unavailable" (no lensd
  /// there, or it went in mid-call), "SocketRefused", "SocketFailed", "DeadlinePassed", "BrokenReply", "BadText" (of a
  /// quantity); "UnknownError" of a newer lensd.
  const std::string& name() const;
  /// name() is this one; "Timeout" is "DeadlinePassed" too, and "NotPermitted" "SocketRefused".
  bool Is(const char* name) const;
  /// What lensctl ends with for the same error, and its word: 6, "out-of-range".
  int exit_status() const;
  const std::string& code() const;

  std::string lens() const;
  std::string axis() const;
  std::string parameter() const;
  std::optional<double> minimum() const;
  std::optional<double> maximum() const;
  std::string unit() const;
  /// Everything that was told beside the message, as a JSON object.
  const std::string& fields() const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;  // what is thrown is copied, and a copy must not throw
};

}  // namespace v1
}  // namespace lensd

#endif
