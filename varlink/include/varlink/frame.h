// Framing: messages are UTF-8 JSON objects, each followed by one NUL byte.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace lensd::varlink {

/// Longest message accepted or sent, its NUL not counted.
inline constexpr std::size_t kMaxMessageBytes = std::size_t{1} << 20;

/// Cuts a byte stream into messages, however the reads fall.
class FrameReader {
 public:
  /// Adds what was read.
  void Append(std::string_view bytes);
  /// The next whole message without its NUL, or none yet; valid until the next call of Append(). Code::Protocol: a
  /// message longer than kMaxMessageBytes, whole or not. The stream is then of no further use.
  Result<std::optional<std::string_view>> Next();
  /// Bytes held that Next() has not handed out.
  std::size_t pending() const { return buffer_.size() - start_; }

 private:
  std::string buffer_;
  std::size_t start_ = 0;    // where the next message begins
  std::size_t scanned_ = 0;  // no NUL before this
};

}  // namespace lensd::varlink
