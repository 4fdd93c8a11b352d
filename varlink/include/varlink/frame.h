// Framing: messages are UTF-8 JSON objects, each followed by one NUL byte.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace lensd::varlink {

/// Longest call a service takes, its NUL not counted.
inline constexpr std::size_t kMaxMessageBytes = std::size_t{1} << 20;
/// Longest reply a client takes: a plan of a megabyte of limits has several megabytes of answers.
inline constexpr std::size_t kMaxReplyBytes = std::size_t{64} << 20;

/// Cuts a byte stream into messages, however the reads fall.
class FrameReader {
 public:
  /// Of messages of at most `longest` bytes.
  explicit FrameReader(std::size_t longest = kMaxMessageBytes) : longest_(longest) {}
  /// Adds what was read.
  void Append(std::string_view bytes);
  /// The next whole message without its NUL, or none yet; valid until the next call of Append(). Code::Protocol: a
  /// message longer than that, whole or not. The stream is then of no further use.
  Result<std::optional<std::string_view>> Next();
  /// Bytes held that Next() has not handed out.
  std::size_t pending() const { return buffer_.size() - start_; }

 private:
  std::size_t longest_;
  std::string buffer_;
  std::size_t start_ = 0;    // where the next message begins
  std::size_t scanned_ = 0;  // no NUL before this
};

}  // namespace lensd::varlink
