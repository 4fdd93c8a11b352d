// What a Stream is inside.
#pragma once

#include <atomic>
#include <optional>
#include <utility>

#include "connection.h"

namespace lensd {
inline namespace v1 {

struct Stream::Impl {
  Impl(Connection open, Milliseconds reply_timeout)
      : connection(std::move(open)), timeout(reply_timeout), deadline(reply_timeout) {}

  /// The next reply's parameters; nothing: ended. Throws errors.
  std::optional<Json> Next();
  /// The same without waiting; nothing may also be: not yet.
  std::optional<Json> Process();
  Milliseconds Left() const;

  Connection connection;
  Milliseconds timeout;
  Deadline deadline;  // of the next reply
  bool ended = false;
  std::atomic<bool> cancelled = false;

 private:
  std::optional<Json> Taken(Message message);
  /// After what `error` says nothing more comes; a Cancel() is no error.
  std::optional<Json> Ended();
};

}  // namespace v1
}  // namespace lensd
